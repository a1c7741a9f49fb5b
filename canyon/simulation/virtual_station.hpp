#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/relative/corrections.hpp"
#include "canyon/simulation/environment.hpp"

namespace canyon::simulation {

/// A network's virtual reference station: a base's measurements as they would be at the place that a rover
/// reports. Codes and phases move by the difference of the ranges, and of orbits and atmosphere as
/// Environment::errors() has them at both places: a network that knows the atmosphere without an error. Noise
/// and echoes stay the base's. The station keeps its place until the rover reports one more than kMove_m
/// away; then the phases begin anew.
class VirtualStation {
 public:
  static constexpr double kMove_m = 5000;

  /// @param base its epoch, null gives null @param time true instant of that epoch
  /// @param base_ecef true place of its antenna [m]
  /// @param reported_ecef the rover's last fix [m]; empty as long as there was none: null, as a caster that
  /// has no GGA yet sends nothing
  [[nodiscard]] std::shared_ptr<const relative::Corrections> corrections(
      const std::shared_ptr<const relative::Corrections>& base, geodesy::GpsTime time,
      const Eigen::Vector3d& base_ecef, const std::optional<Eigen::Vector3d>& reported_ecef,
      const Environment& environment);

 private:
  std::optional<Eigen::Vector3d> place_;
  geodesy::GpsTime since_;
};

}  // namespace canyon::simulation
