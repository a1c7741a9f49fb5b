#include "canyon/positioning/fusion/strapdown.hpp"

#include "canyon/geodesy/constants.hpp"

namespace canyon::positioning {

using Eigen::Quaterniond;
using Eigen::Vector3d;

Quaterniond rotation_of(const Vector3d& turn) {
  const double angle = turn.norm();
  if (angle == 0) return Quaterniond::Identity();
  return Quaterniond(Eigen::AngleAxisd(angle, turn / angle));
}

Eigen::Matrix3d skew(const Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

void carry(InertialState& state, const FeltMotion& felt, double dt_s, const Vector3d& gravity_mps2) {
  const Vector3d earth(0, 0, geodesy::kEarthRotationRate);
  const Vector3d turn = felt.angular_rate_radps * dt_s, push = felt.specific_force_mps2 * dt_s;
  // The force turns with the body, and the axes with the Earth.
  const Vector3d pushed = state.ecef_from_body * (push + 0.5 * turn.cross(push));
  const Vector3d pushed_on_earth = pushed - 0.5 * dt_s * earth.cross(pushed);
  // Coriolis at the middle of the interval.
  const Vector3d middle = state.velocity_mps + 0.5 * (pushed + gravity_mps2 * dt_s);
  const Vector3d before = state.velocity_mps;
  state.velocity_mps += pushed_on_earth + (gravity_mps2 - 2 * earth.cross(middle)) * dt_s;
  state.position_m += 0.5 * dt_s * (before + state.velocity_mps);
  state.ecef_from_body = (rotation_of(-dt_s * earth) * state.ecef_from_body * rotation_of(turn)).normalized();
  state.time = state.time + dt_s;
}

}  // namespace canyon::positioning
