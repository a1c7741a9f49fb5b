#pragma once

#include <Eigen/Core>
#include <optional>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/run/epoch.hpp"

namespace canyon::simulation {

/// A network's virtual reference station: a base's measurements as they would be at the place that a rover
/// reports. Codes and phases move by the difference of the terms of satellites and of space between both
/// places (receiver::range_terms(), as the base's options switch them): a network that knows the atmosphere
/// without an error. Noise and echoes stay the base's. The station keeps its place until the rover reports
/// one more than kMove_m away; then the phases begin anew.
class VirtualStation {
 public:
  static constexpr double kMove_m = 5000;

  /// @param base with Epoch::environment and options
  /// @param reported_ecef the rover's last fix [m]
  /// @return the base's epoch with measurements and true place of the virtual station. Its fix stays the
  /// base's. Empty as long as nothing was reported, as a caster that has no GGA yet sends nothing
  [[nodiscard]] std::optional<Epoch> move(const Epoch& base,
                                          const std::optional<Eigen::Vector3d>& reported_ecef);

 private:
  std::optional<Eigen::Vector3d> place_;
  geodesy::GpsTime since_;
};

}  // namespace canyon::simulation
