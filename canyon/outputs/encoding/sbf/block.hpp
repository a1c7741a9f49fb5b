#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/outputs/encoding/observations/raw_observations.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::encoding::sbf {

// Blocks of Septentrio's binary format SBF (PolaRx5TR Reference Guide, firmware 5.5.0, chapter 4): "$@",
// CRC, ID, length, time of week and week, body; numbers little-endian, lengths multiples of four bytes.
/// Number, revision and command name of a block.
struct BlockId {
  std::uint16_t number;
  std::uint8_t revision = 0;
  std::string_view name = {};
};

inline constexpr BlockId kMeasEpoch{4027, 1, "MeasEpoch"}, kEndOfMeas{5922, 0, "EndOfMeas"},
    kPvtGeodetic{4007, 2, "PVTGeodetic"}, kPosCovGeodetic{5906, 0, "PosCovGeodetic"},
    kVelCovGeodetic{5908, 0, "VelCovGeodetic"}, kDop{4001, 0, "DOP"}, kEndOfPvt{5921, 0, "EndOfPVT"},
    kReceiverTime{5914, 0, "ReceiverTime"}, kChannelStatus{4013, 0, "ChannelStatus"},
    kReceiverStatus{4014, 1, "ReceiverStatus"}, kRfStatus{4092, 0, "RFStatus"},
    kBaseVectorGeod{4028, 0, "BaseVectorGeod"}, kAttEuler{5938, 0, "AttEuler"},
    kAttCovEuler{5939, 0, "AttCovEuler"}, kGpsRawCa{4017, 0, "GPSRawCA"}, kGalRawInav{4023, 0, "GALRawINAV"},
    kGloRawCa{4026, 0, "GLORawCA"}, kBdsRaw{4047, 0, "BDSRaw"}, kQzsRawL1Ca{4066, 0, "QZSRawL1CA"};
inline constexpr std::array kBlocks{
    kMeasEpoch,    kEndOfMeas,     kPvtGeodetic,    kPosCovGeodetic, kVelCovGeodetic, kDop,      kEndOfPvt,
    kReceiverTime, kChannelStatus, kReceiverStatus, kRfStatus,       kBaseVectorGeod, kAttEuler, kAttCovEuler,
    kGpsRawCa,     kGalRawInav,    kGloRawCa,       kBdsRaw,         kQzsRawL1Ca};

/// CRC of ITU-T V.41 (polynomial x^16 + x^12 + x^5 + 1, seed 0), as used in blocks.
[[nodiscard]] std::uint16_t crc16(std::string_view bytes);

/// The complete block. Zeros fill the body up to a multiple of four bytes.
/// @param time its time stamp, rounded down to a millisecond; empty: the receiver has no time
[[nodiscard]] std::string block(BlockId id, const std::optional<geodesy::GpsTime>& time,
                                std::string_view body);

/// Number of a satellite in blocks (4.1.9); empty for satellites that have none.
[[nodiscard]] std::optional<std::uint8_t> satellite_number(gnss::SatelliteId id);

/// FreqNr of a satellite: for GLONASS its frequency number plus 8; 0 for others.
[[nodiscard]] int frequency_number(gnss::SatelliteId id, const std::map<gnss::SatelliteId, int>& channels);

/// Index of a signal's two bits in the status fields of ChannelStatus (4.2.15), 0 to 7; empty: no bits.
[[nodiscard]] std::optional<int> status_bit_offset(const gnss::Signal& signal);

// Bodies of the blocks that the device sends, field by field as in the PolaRx5TR Reference Guide
// (firmware 5.5.0, 4.2). Fields unknown to Canyon have their "Do-Not-Use" value.
/// The blocks of an epoch by number, in the order in which the device sends them.
[[nodiscard]] std::span<const std::uint16_t> epoch_blocks();
/// A block of an epoch. Empty if the epoch has no data for it: vector and attitude without a baseline.
/// Precondition: `number` is one of epoch_blocks().
[[nodiscard]] std::string epoch_block(std::uint16_t number, const DeviceEpoch& epoch);

/// GPSRawCA, GALRawINAV, GLORawCA, BDSRaw or QZSRawL1CA; empty for satellites of other systems.
/// @param time reported by the receiver for the end of the message
[[nodiscard]] std::string message_block(const broadcast::SentMessage& message, geodesy::GpsTime time,
                                        const std::map<gnss::SatelliteId, int>& glonass_channels);
/// The number of raw_block()'s block; 0 for systems without one.
[[nodiscard]] std::uint16_t message_number(gnss::System system);

}  // namespace canyon::encoding::sbf
