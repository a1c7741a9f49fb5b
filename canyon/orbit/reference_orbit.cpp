#include "canyon/orbit/reference_orbit.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "canyon/geodesy/constants.hpp"

namespace canyon::orbit {

using geodesy::kEarthJ2;
using geodesy::kEarthMu;
using geodesy::kSemiMajorAxis;

// Elements from vectors: Vallado, Fundamentals of Astrodynamics, 2.5; secular rates: the same, 9-37 to 9-41.
ReferenceOrbit::ReferenceOrbit(geodesy::GpsTime epoch, const Eigen::Vector3d& position,
                               const Eigen::Vector3d& velocity)
    : epoch_(epoch) {
  const double r = position.norm();
  const double a = 1 / (2 / r - velocity.squaredNorm() / kEarthMu);
  const Eigen::Vector3d h = position.cross(velocity);
  const Eigen::Vector3d to_perigee = velocity.cross(h) / kEarthMu - position / r;
  const double e = to_perigee.norm();
  // The condition is negated, so that NaN is refused.
  if (!(a > kSemiMajorAxis && a < 1e9 && e < 0.9)) return;
  semi_major_axis_ = a;
  eccentricity_ = e;
  axes_.col(2) = h.normalized();
  // A circle has its perigee where we are.
  axes_.col(0) = e > 1e-10 ? (to_perigee / e).eval() : (position / r).eval();
  axes_.col(1) = axes_.col(2).cross(axes_.col(0));
  const double eccentric =
      std::atan2(position.dot(axes_.col(1)) / std::sqrt(1 - e * e), position.dot(axes_.col(0)) + a * e);
  mean_anomaly_ = eccentric - e * std::sin(eccentric);
  mean_motion_ = std::sqrt(kEarthMu / (a * a * a));
  const double p = a * (1 - e * e);
  const double k = 1.5 * mean_motion_ * kEarthJ2 * (kSemiMajorAxis / p) * (kSemiMajorAxis / p);
  const double cos_i = axes_(2, 2);
  node_rate_ = -k * cos_i;
  perigee_rate_ = k * (2 - 2.5 * (1 - cos_i * cos_i));
}

ReferenceOrbit::State ReferenceOrbit::at(geodesy::GpsTime t) const {
  State state;
  const double dt = t - epoch_;
  if (semi_major_axis_ == 0) {
    state.true_anomaly_rad = dt / 3600;
    state.true_anomaly_rate = 1 / 3600.0;
    return state;
  }
  const double e = eccentricity_;
  const double mean = mean_anomaly_ + mean_motion_ * dt;
  const double wrapped = std::remainder(mean, 2 * geodesy::kPi);
  double eccentric = wrapped + e * std::sin(wrapped);
  for (int i = 0; i < 20; ++i) {
    const double step = (eccentric - e * std::sin(eccentric) - wrapped) / (1 - e * std::cos(eccentric));
    eccentric -= step;
    if (std::abs(step) < 1e-15) break;
  }
  const double c = std::cos(eccentric);
  const double s = std::sin(eccentric);
  const double flat = std::sqrt(1 - e * e);
  const double b = semi_major_axis_ * flat;
  const double rate = mean_motion_ / (1 - e * c);
  const Eigen::Matrix3d axes =
      Eigen::AngleAxisd(node_rate_ * dt, Eigen::Vector3d::UnitZ()) * axes_ *
      Eigen::AngleAxisd(perigee_rate_ * dt, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d turning = Eigen::Vector3d(0, 0, node_rate_) + perigee_rate_ * axes.col(2);
  state.position_m = axes * Eigen::Vector3d(semi_major_axis_ * (c - e), b * s, 0);
  state.velocity_mps =
      axes * Eigen::Vector3d(-semi_major_axis_ * s * rate, b * c * rate, 0) + turning.cross(state.position_m);
  // The difference of true and mean anomaly has no jump, so the sum counts revolutions as the mean anomaly
  // does.
  state.true_anomaly_rad = mean + (std::atan2(flat * s, c - e) - wrapped);
  state.true_anomaly_rate = rate * flat / (1 - e * c);
  return state;
}

}  // namespace canyon::orbit
