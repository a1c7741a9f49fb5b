#pragma once

#include <Eigen/Core>
#include <optional>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/simulation/epoch.hpp"

namespace canyon::simulation {

/// A network's virtual reference station: a base's measurements as they would be at the position that a rover
/// reports. Codes and phases are shifted by the difference of the satellite and atmosphere terms between both
/// positions (receiver::range_terms(), as the base's options enable them): a network without atmosphere
/// errors. Noise and multipath are the base's. The station does not move until the rover reports a position
/// more than kMove_m away; then the phases restart.
class VirtualStation {
 public:
  static constexpr double kMove_m = 5000;

  /// @param base with Epoch::environment and options
  /// @param reported_ecef the rover's last fix [m]
  /// @return the base's epoch with measurements and true position of the virtual station. Its fix is the
  /// base's. Empty until a position is reported, as a caster without a GGA sends nothing
  [[nodiscard]] std::optional<Epoch> move(const Epoch& base,
                                          const std::optional<Eigen::Vector3d>& reported_ecef);

 private:
  std::optional<Eigen::Vector3d> position_;
  geodesy::GpsTime since_;
};

}  // namespace canyon::simulation
