#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/satellite_id.hpp"
#include "canyon/orbit/sky.hpp"

// Pseudoranges of messages that leave out whole milliseconds of light's way (RTCM 10403.3, 3.5.16.3: MSM1 to
// MSM3; table 3.5-1: 1001, 1003, 1009, 1011).

namespace canyon::rtcm {

/// A pseudorange without the clock of the receiver [m]: the way from a satellite to a place less the
/// satellite's clock. Within 1 km of what is measured. Empty where the satellite is not known then.
/// @param place of the station, ECEF [m]; zeros where it has not stated it
using RangeTable = std::function<std::optional<double>(gnss::SatelliteId, geodesy::GpsTime reception,
                                                       const Eigen::Vector3d& place)>;
/// By the ephemerides of a sky. @param fallback a place within 50 km of a station that states none [m]
[[nodiscard]] RangeTable range_table(std::shared_ptr<const orbit::Sky> sky,
                                     const Eigen::Vector3d& fallback = Eigen::Vector3d::Zero());

/// A pseudorange modulo a length.
struct PartialRange {
  double modulo_m = 0;     ///< [0, unit)
  double unit_m = 0;       ///< one or two light milliseconds
  double predicted_m = 0;  ///< by a RangeTable
};

/// The whole units to add to each range [m]. All satellites of an epoch have the receiver's clock
/// in common, which is taken as within half a millisecond. Empty for a satellite that contradicts the clock
/// of most by more than a twentieth of a millisecond (15 km), and for all where fewer than four, or less
/// than two thirds of them, agree on it: place or ephemerides are wrong then.
[[nodiscard]] std::vector<std::optional<double>> whole_milliseconds(const std::vector<PartialRange>& ranges);

}  // namespace canyon::rtcm
