#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>

#include "canyon/broadcast/schedule.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/satellite_id.hpp"
#include "canyon/output/sbf/block.hpp"
#include "canyon/positioning/fix.hpp"
#include "canyon/receiver/receiver.hpp"

// Bodies of the blocks that the device sends, field by field as the PolaRx5TR Reference Guide
// (firmware 5.5.0, 4.2) has them. Fields that Canyon does not know have their "Do-Not-Use" value.

namespace canyon::output::sbf {

/// One observable of MeasEpoch.
struct Observable {
  gnss::SatelliteId id;
  const gnss::Signal* signal = nullptr;
  const positioning::Measurement* measurement = nullptr;
  double pseudorange_m = 0;                    ///< for the epoch's tag
  std::optional<double> carrier_phase_cycles;  ///< likewise
  std::optional<double> doppler_hz;            ///< likewise
  double locked_s = 0;                         ///< since the first phase of its arc
};

/// An epoch with everything that its blocks need.
struct Epoch {
  const receiver::ReceiverEpoch& seen;
  std::optional<geodesy::GpsTime> time;  ///< that the receiver states; empty before its first fix
  geodesy::GpsTime tag;                  ///< of the measurements, a whole millisecond of the receiver's clock
  std::span<const Observable> observables;  ///< by satellite
  const std::map<gnss::SatelliteId, int>& glonass_channels;
  double uptime_s = 0;
  double geoid_undulation_m = 0;
};

/// The blocks of an epoch by number, in the order in which the device sends them.
[[nodiscard]] std::span<const std::uint16_t> epoch_blocks();
/// A block of an epoch. Empty where the epoch has none of it: vector and attitude without a baseline.
/// Precondition: `number` is one of epoch_blocks().
[[nodiscard]] std::string epoch_block(std::uint16_t number, const Epoch& epoch);

/// GPSRawCA, GALRawINAV, GLORawCA, BDSRaw or QZSRawL1CA; empty for a satellite that these do not have.
/// @param time that the receiver states for the end of the message
[[nodiscard]] std::string message_block(const broadcast::SentMessage& message, geodesy::GpsTime time,
                                        const std::map<gnss::SatelliteId, int>& glonass_channels);
/// The number of that block; 0 for systems without one.
[[nodiscard]] std::uint16_t message_number(gnss::System system);

/// MeasEpoch's body.
[[nodiscard]] std::string meas_epoch(const Epoch& epoch);

}  // namespace canyon::output::sbf
