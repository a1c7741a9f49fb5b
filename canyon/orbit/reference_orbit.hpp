#pragma once

#include <Eigen/Core>

#include "canyon/geodesy/gps_time.hpp"

namespace canyon::orbit {

/// A Kepler orbit with the secular rates of J2, for subtracting the bulk of a motion from tabulated
/// positions: what is left is kilometres instead of the orbit's size, and interpolates better by as much.
/// Axes do not rotate and have the Earth's pole as z.
class ReferenceOrbit {
 public:
  struct State {
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
    double true_anomaly_rad = 0;   ///< counted through revolutions; grows with time
    double true_anomaly_rate = 0;  ///< [rad/s]
  };

  /// Position and velocity are zero everywhere: it subtracts nothing. The anomaly is the time [h].
  ReferenceOrbit() = default;
  /// The orbit through a position [m] and velocity [m/s] at `epoch`; the default one where they give no
  /// ellipse with e < 0.9 above the Earth.
  ReferenceOrbit(geodesy::GpsTime epoch, const Eigen::Vector3d& position, const Eigen::Vector3d& velocity);

  [[nodiscard]] State at(geodesy::GpsTime t) const;

  /// Changes the mean motion by a factor, keeping the position at the epoch.
  void scale_mean_motion(double factor) { mean_motion_ *= factor; }

 private:
  geodesy::GpsTime epoch_;
  double semi_major_axis_ = 0;
  double eccentricity_ = 0;
  double mean_anomaly_ = 0;                             ///< at the epoch
  double mean_motion_ = 0;                              ///< [rad/s]
  double node_rate_ = 0;                                ///< [rad/s]
  double perigee_rate_ = 0;                             ///< [rad/s]
  Eigen::Matrix3d axes_ = Eigen::Matrix3d::Identity();  ///< perigee, along, normal at the epoch, as columns
};

}  // namespace canyon::orbit
