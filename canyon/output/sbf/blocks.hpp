#pragma once

#include <map>
#include <span>
#include <string>

#include "canyon/output/observations/device_epochs.hpp"
#include "canyon/output/sbf/block.hpp"

// Bodies of the blocks that the device sends, field by field as the PolaRx5TR Reference Guide
// (firmware 5.5.0, 4.2) has them. Fields that Canyon does not know have their "Do-Not-Use" value.

namespace canyon::output::sbf {

/// The blocks of an epoch by number, in the order in which the device sends them.
[[nodiscard]] std::span<const std::uint16_t> epoch_blocks();
/// A block of an epoch. Empty where the epoch has none of it: vector and attitude without a baseline.
/// Precondition: `number` is one of epoch_blocks().
[[nodiscard]] std::string epoch_block(std::uint16_t number, const DeviceEpoch& epoch);

/// GPSRawCA, GALRawINAV, GLORawCA, BDSRaw or QZSRawL1CA; empty for a satellite that these do not have.
/// @param time that the receiver states for the end of the message
[[nodiscard]] std::string message_block(const broadcast::SentMessage& message, geodesy::GpsTime time,
                                        const std::map<gnss::SatelliteId, int>& glonass_channels);
/// The number of that block; 0 for systems without one.
[[nodiscard]] std::uint16_t message_number(gnss::System system);

/// MeasEpoch's body.
[[nodiscard]] std::string meas_epoch(const DeviceEpoch& epoch);

}  // namespace canyon::output::sbf
