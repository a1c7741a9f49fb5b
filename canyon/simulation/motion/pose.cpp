#include "canyon/simulation/motion/pose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace canyon::simulation {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Vector3d Pose::forward_enu() const {
  const double level = std::cos(pitch_rad);
  return {std::cos(yaw_rad) * level, std::sin(yaw_rad) * level, std::sin(pitch_rad)};
}

Vector3d Pose::up_enu() const {
  const double forward = -std::cos(roll_rad) * std::sin(pitch_rad), left = -std::sin(roll_rad);
  const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  return {c * forward - s * left, s * forward + c * left, std::cos(roll_rad) * std::cos(pitch_rad)};
}

std::string impossible_motion(double height_m, const Vector3d& velocity_mps) {
  constexpr double kFastest_mps = 1000, kLowest_m = -1e3, kHighest_m = 100e3;
  const double speed_mps = velocity_mps.norm();
  if (!(speed_mps < kFastest_mps))
    return fmt::format("no vehicle moves at {:.0f} m/s (at most 1,000 m/s)", speed_mps);
  if (!(height_m >= kLowest_m && height_m <= kHighest_m))
    return fmt::format("no vehicle is at a height of {:.0f} m (-1 to 100 km)", height_m);
  return {};
}

bool is_possible(const Pose& pose, const geodesy::LocalFrame& city) {
  constexpr double kFarthest_m = 1e7, kFastest_mps = 1e6;
  const auto finite = [](auto... values) { return (std::isfinite(values) && ...); };
  return finite(pose.yaw_rad, pose.yaw_rate_radps, pose.roll_rad, pose.pitch_rad) &&
         city.local_from_geodetic(pose.position).norm() <= kFarthest_m &&
         pose.velocity_enu_mps.norm() <= kFastest_mps;
}

Eigen::Matrix3d enu_from_body(const Pose& pose) {
  return (AngleAxisd(pose.yaw_rad, Vector3d::UnitZ()) * AngleAxisd(-pose.pitch_rad, Vector3d::UnitY()) *
          AngleAxisd(pose.roll_rad, Vector3d::UnitX()))
      .toRotationMatrix();
}

EcefPose body_state(const Pose& pose) {
  const Eigen::Matrix3d ecef_from_enu = geodesy::enu_from_ecef_rotation(pose.position).transpose();
  return {geodesy::ecef_from_geodetic(pose.position), ecef_from_enu * pose.velocity_enu_mps,
          ecef_from_enu * pose.acceleration_enu_mps2, ecef_from_enu * enu_from_body(pose)};
}

bool same_pose(const RigidPose& a, const RigidPose& b) {
  return (a.position_m - b.position_m).cwiseAbs().maxCoeff() <= 1e-6 &&
         (a.attitude.coeffs() - b.attitude.coeffs()).cwiseAbs().maxCoeff() <= 1e-6;
}

RigidPose motion_between(const RigidPose& from, const RigidPose& to, double seconds) {
  RigidPose motion{to.position_m, to.attitude};
  const Vector3d direction = to.position_m - from.position_m;
  if (!(direction.norm() <= kTeleport_mps * seconds)) return motion;
  motion.linear_velocity = direction / seconds;
  Quaterniond rotation = to.attitude * from.attitude.inverse();
  if (rotation.w() < 0) rotation.coeffs() *= -1;  // the same rotation, by the smaller angle
  const double sine = rotation.vec().norm();
  if (sine > 0)
    motion.angular_velocity = rotation.vec() * (2 * std::atan2(sine, rotation.w()) / sine / seconds);
  return motion;
}

RigidPose moved_on(const RigidPose& body, double seconds) {
  RigidPose moved = body;
  moved.position_m += body.linear_velocity * seconds;
  const double rotation_rad = body.angular_velocity.norm() * seconds;
  if (rotation_rad != 0)
    moved.attitude = Eigen::AngleAxisd(rotation_rad, body.angular_velocity.normalized()) * body.attitude;
  return moved;
}

std::optional<RigidPose> proper_pose(const RigidPose& pose) {
  const double norm = pose.attitude.norm();
  if (!std::isfinite(norm) || !pose.position_m.allFinite() || norm < 1e-6) return std::nullopt;
  RigidPose proper = pose;
  proper.attitude.coeffs() /= norm;
  return proper;
}

Eigen::Matrix3d WorldFrame::enu_from_world() const {
  return Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

bool operator==(const WorldFrame& a, const WorldFrame& b) {
  const geodesy::Geodetic &at = a.enu.origin(), &other = b.enu.origin();
  return at.latitude_rad == other.latitude_rad && at.longitude_rad == other.longitude_rad &&
         at.height_m == other.height_m && a.enu.heading_rad() == b.enu.heading_rad() &&
         a.heading_rad == b.heading_rad;
}

Pose pose_of(const RigidPose& body, const WorldFrame& world, geodesy::GpsTime time,
             const Vector3d& lever_arm_m) {
  const Vector3d arm = body.attitude * lever_arm_m;
  const Eigen::Matrix3d city_from_world = world.enu_from_world();
  Pose pose;
  pose.time = time;
  pose.position =
      world.enu.geodetic_from_local(world.origin_enu_m + city_from_world * (body.position_m + arm));
  // East, north and up at the body's position.
  const Eigen::Matrix3d enu_from_world =
      geodesy::enu_from_ecef_rotation(pose.position) * world.enu.ecef_from_local_rotation() * city_from_world;
  const Eigen::Matrix3d rotation = enu_from_world * body.attitude.toRotationMatrix();
  pose.velocity_enu_mps = enu_from_world * (body.linear_velocity + body.angular_velocity.cross(arm));
  pose.yaw_rad = std::atan2(rotation(1, 0), rotation(0, 0));
  pose.pitch_rad = std::asin(std::clamp(rotation(2, 0), -1.0, 1.0));
  pose.roll_rad = std::atan2(rotation(2, 1), rotation(2, 2));
  pose.yaw_rate_radps = (enu_from_world * body.angular_velocity).z();
  return pose;
}

}  // namespace canyon::simulation
