#include "canyon/inertial/ideal_imu.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/frames.hpp"

namespace canyon::inertial {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The rotation vector of a small turn.
Vector3d turn_of(const Matrix3d& rotation) {
  // Half of the antisymmetric part is the axis times the sine of the angle.
  const Vector3d sine = 0.5 * Vector3d(rotation(2, 1) - rotation(1, 2), rotation(0, 2) - rotation(2, 0),
                                       rotation(1, 0) - rotation(0, 1));
  const double s = sine.norm();
  return s > 0 ? (std::asin(std::min(1.0, s)) / s) * sine : sine;
}

}  // namespace

IdealImu::IdealImu(const ImuOptions& options, BodyMotion motion, double step_s)
    : motion_(std::move(motion)), step_s_(step_s), position_m_(options.position_m) {
  body_from_sensor_ = body_from_sensor(options.orientation, options.axes);
}

const BodyState& IdealImu::body(std::int64_t index) {
  // Indices begin at -2.
  auto& kept = bodies_.at(static_cast<std::size_t>((index + kKept) % kKept));
  if (!kept || kept->first != index)
    kept = {index, motion_(std::round(static_cast<double>(index) * step_s_ * 1e9) / 1e9)};
  return kept->second;
}

const Vector3d& IdealImu::turn(std::int64_t index) {
  auto& kept = turns_.at(static_cast<std::size_t>((index + kKept) % kKept));
  if (!kept || kept->first != index) {
    const Matrix3d& now = body(index).ecef_from_body;
    kept = {index, turn_of(now.transpose() * body(index + 1).ecef_from_body)};
  }
  return kept->second;
}

Vector3d IdealImu::gravity(const Vector3d& place_m) {
  Vector3d off = place_m - gravity_place_m_;
  if (off.squaredNorm() > 1) {
    gravity_place_m_ = place_m;
    gravity_mps2_ = geodesy::normal_gravity(place_m);
    // That of a point mass: within 1 %, 3e-8 m/s^2 over a metre of height and 1e-8 over one along the ground.
    const Vector3d up = place_m.normalized();
    const double per_m = gravity_mps2_.norm() / place_m.norm();
    gravity_gradient_ = per_m * (3 * up * up.transpose() - Matrix3d::Identity());
    off.setZero();
  }
  return gravity_mps2_ + gravity_gradient_ * off;
}

ImuState IdealImu::at(std::int64_t index) {
  auto& kept = states_.at(static_cast<std::size_t>(index % kKept));
  if (kept && kept->first == index) return kept->second;
  const BodyState& body = this->body(index);
  const auto attitude = [this, index](std::int64_t off) -> const Matrix3d& {
    return this->body(index + off).ecef_from_body;
  };
  // Turns from the attitude now, in the body's axes; those to the neighbours are along their own axes.
  const auto far = [&](std::int64_t off) { return turn_of(body.ecef_from_body.transpose() * attitude(off)); };
  const Vector3d rate = (far(-2) + 8 * turn(index - 1) + 8 * turn(index) - far(2)) / (12 * step_s_);

  ImuState state;
  state.sensor.ecef_from_body = body.ecef_from_body * body_from_sensor_;
  // The arm from the vehicle's point, and its derivatives.
  const Vector3d arm = body.ecef_from_body * position_m_;
  state.sensor.position_m = body.position_m + arm;
  state.sensor.velocity_mps = body.velocity_mps + body.ecef_from_body * rate.cross(position_m_);
  Vector3d second = Vector3d::Zero();
  if (!position_m_.isZero(0)) {
    const auto moved = [&](std::int64_t off) -> Vector3d { return attitude(off) * position_m_ - arm; };
    second = (-moved(-2) + 16 * moved(-1) + 16 * moved(1) - moved(2)) / (12 * step_s_ * step_s_);
  }
  state.sensor.acceleration_mps2 = body.acceleration_mps2 + second;

  const Vector3d earth(0, 0, geodesy::kEarthRotationRate);
  const Vector3d force = state.sensor.acceleration_mps2 + 2 * earth.cross(state.sensor.velocity_mps) -
                         gravity(state.sensor.position_m);
  const Matrix3d sensor_from_ecef = state.sensor.ecef_from_body.transpose();
  state.input.specific_force_mps2 = sensor_from_ecef * force;
  state.input.angular_rate_radps = sensor_from_ecef * earth + body_from_sensor_.transpose() * rate;
  kept = {index, state};
  return state;
}

ImuInput IdealImu::mean(std::int64_t from, std::int64_t to) {
  ImuInput sum;  // over 3 / step_s_
  const Vector3d earth(0, 0, geodesy::kEarthRotationRate);
  for (std::int64_t i = from; i <= to; ++i) {
    const double weight = i == from || i == to ? 1 : (i - from) % 2 == 1 ? 4 : 2;
    const ImuState state = at(i);
    sum.specific_force_mps2 += weight * state.input.specific_force_mps2;
    sum.angular_rate_radps += weight * (state.sensor.ecef_from_body.transpose() * earth);
  }
  // Turns of the body, from attitude to attitude, less what a moving axis adds to them (coning).
  Vector3d turned = Vector3d::Zero(), before = turn(from - 1), now = turn(from);
  for (std::int64_t i = from; i < to; ++i) {
    const Vector3d after = turn(i + 1);
    turned += now - now.cross(after - before) / 24;
    before = now;
    now = after;
  }
  const auto steps = static_cast<double>(to - from);
  return {sum.specific_force_mps2 / (3 * steps),
          sum.angular_rate_radps / (3 * steps) + body_from_sensor_.transpose() * turned / (steps * step_s_)};
}

}  // namespace canyon::inertial
