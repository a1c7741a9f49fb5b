#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/receiver/positioning/positioning_options.hpp"
#include "canyon/receiver/rtk/correction_link.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::rtk {

/// One signal at one antenna: measured minus computed from a position, the ephemerides and models.
struct ObservedMinusComputed {
  gnss::SatelliteId id;
  const gnss::Signal* signal = nullptr;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< unit, ECEF, antenna to satellite
  double elevation_rad = 0;
  double wavelength_m = 0;
  double code_m = 0;   ///< includes the receiver's clock, and all errors and terms without a model
  double sigma_m = 1;  ///< Measurement::sigma_m
  /// Likewise, with the ambiguity, and without the satellite's group delays, which may differ between
  /// interchangeable components of a carrier; empty without a phase.
  std::optional<double> phase_m;
  /// 1 + 1 / sin(elevation)^2 + 10^((45 - C/N0) / 10): ratio of a variance to that at the zenith.
  double variance = 1;
  std::optional<double> doppler_mps;  ///< range rate, positive when receding
  std::optional<geodesy::GpsTime> phase_since;
  bool half_cycle = false;
  bool aligned = true;  ///< SignalMeasurement::aligned
};

/// Uses satellites of the sky, at or above both masks (elevation, C/N0); sorted by satellite and signal.
/// @param options masks, and which models of the atmosphere are computed @param point of the antenna, ECEF
/// [m] @param klobuchar needed with FixOptions::correct_ionosphere
/// Throws InputError for measurements that are not numbers.
[[nodiscard]] std::vector<ObservedMinusComputed> observed_minus_computed(
    geodesy::GpsTime receiver_time, std::span<const SignalMeasurement> observations, const orbit::Sky& sky,
    const positioning::FixOptions& options, const Eigen::Vector3d& point,
    const std::map<gnss::System, gnss::Klobuchar>& klobuchar = {});

/// Whether `a` comes before `b` in this order.
[[nodiscard]] bool before(const ObservedMinusComputed& a, const ObservedMinusComputed& b);

}  // namespace canyon::rtk
