#include "canyon/simulation/motion/vehicle_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::simulation {

using Eigen::Vector3d;

namespace {

constexpr double kMaxDistanceFromWorld_m = 100e3;

void check_waypoints(const std::vector<Vector3d>& waypoints, const VehicleDrive::WaypointOptions& options) {
  if (waypoints.empty()) throw InputError("the list of waypoints is empty", "give at least one");
  for (std::size_t i = 0; i < waypoints.size(); ++i) {
    if (!(waypoints[i].norm() <= 1e7)) {
      throw InputError(fmt::format("waypoint {} is not finite, or more than 10000 km away", i + 1),
                       "give waypoints in metres in the world's frame");
    }
  }
  if (!(options.speed_mps > 0) || !(options.speed_mps <= 1e5)) {
    throw InputError(fmt::format("speed_mps: {} m/s is out of range", options.speed_mps),
                     "give a value above 0, at most 100000 m/s");
  }
  if (!(options.hold_s >= 0) || !(options.hold_s <= 1e8))
    throw InputError(fmt::format("hold_s: {} s is out of range", options.hold_s), "give 0 to 1e8 s");
}

}  // namespace

VehicleDrive VehicleDrive::along_waypoints(const std::vector<Vector3d>& waypoints_m,
                                           const WaypointOptions& options) {
  check_waypoints(waypoints_m, options);
  VehicleDrive drive;
  drive.loop_ = options.loop;
  double time_s = 0;
  const auto arrive = [&](const Vector3d& point) {
    if (!drive.stops_.empty()) {
      const double leg_s = (point - drive.stops_.back().position_m).norm() / options.speed_mps;
      if (leg_s > 0) drive.stops_.push_back({time_s += leg_s, point, 0});
    } else {
      drive.stops_.push_back({time_s, point, 0});
    }
  };
  for (const Vector3d& point : waypoints_m) {
    arrive(point);
    if (options.hold_s > 0) drive.stops_.push_back({time_s += options.hold_s, point, 0});
  }
  if (options.loop) arrive(waypoints_m.front());
  drive.end_s_ = time_s;

  // Each leg's yaw; legs without one hold the last, or have that of the first leg with one.
  std::optional<double> yaw;
  std::size_t looking_ahead = 0;
  for (std::size_t i = 0; i < drive.stops_.size(); ++i) {
    if (i + 1 < drive.stops_.size()) {
      const Vector3d leg = drive.stops_[i + 1].position_m - drive.stops_[i].position_m;
      if (leg.head<2>().norm() > 1e-6 * leg.norm()) yaw = std::atan2(leg.y(), leg.x());
    }
    if (!yaw) continue;
    for (; looking_ahead < i; ++looking_ahead) drive.stops_[looking_ahead].yaw_rad = *yaw;
    drive.stops_[i].yaw_rad = *yaw;
    looking_ahead = i + 1;
  }
  return drive;
}

VehicleDrive VehicleDrive::along_trajectory(const Trajectory& trajectory, geodesy::GpsTime start,
                                            const geodesy::LocalFrame& world, bool loop) {
  VehicleDrive drive;
  drive.begin_s_ = trajectory.begin() - start;
  drive.end_s_ = trajectory.end() - start;
  if (drive.end_s_ < 0) {
    throw InputError(fmt::format("the drive ended {:.3f} s before the world's time 0", -drive.end_s_),
                     "check <start>, or leave it out to begin the drive at the world's time 0");
  }
  const double distance_m = world.local_from_geodetic(trajectory.at(trajectory.begin()).position).norm();
  if (distance_m > kMaxDistanceFromWorld_m) {
    throw InputError(fmt::format("the drive begins {:.0f} km from the world's origin", distance_m / 1e3),
                     "give the world the <spherical_coordinates> of its city");
  }
  drive.geodetic_ = Geodetic{trajectory, start, world};
  drive.loop_ = loop;
  return drive;
}

DrivePose VehicleDrive::at(double seconds) const {
  const double period = end_s_ - begin_s_;
  const bool repeats = loop_ && period > 0 && seconds >= begin_s_;
  if (repeats) seconds = begin_s_ + std::fmod(seconds - begin_s_, period);
  DrivePose pose = geodetic_ ? on_earth(seconds) : between_stops(seconds);
  if (seconds < begin_s_ || (!repeats && seconds >= end_s_)) {
    pose.velocity_mps.setZero();
    pose.yaw_rate_radps = 0;
  }
  return pose;
}

DrivePose VehicleDrive::between_stops(double seconds) const {
  const auto after = std::upper_bound(stops_.begin(), stops_.end(), seconds,
                                      [](double time_s, const Stop& stop) { return time_s < stop.time_s; });
  DrivePose pose;
  const Stop& from = after == stops_.begin() ? *after : *(after - 1);
  pose.position_m = from.position_m;
  pose.yaw_rad = from.yaw_rad;
  if (after == stops_.begin() || after == stops_.end()) return pose;
  pose.velocity_mps = (after->position_m - from.position_m) / (after->time_s - from.time_s);
  pose.position_m += pose.velocity_mps * (seconds - from.time_s);
  return pose;
}

DrivePose VehicleDrive::on_earth(double seconds) const {
  const Pose at = geodetic_->trajectory.at(geodetic_->start + seconds);
  const Eigen::Matrix3d world_from_enu = geodetic_->world.ecef_from_local_rotation().transpose() *
                                         geodesy::enu_from_ecef_rotation(at.position).transpose();
  DrivePose pose;
  pose.position_m = geodetic_->world.local_from_geodetic(at.position);
  pose.velocity_mps = world_from_enu * at.velocity_enu_mps;
  const Vector3d ahead = world_from_enu * Vector3d(std::cos(at.yaw_rad), std::sin(at.yaw_rad), 0);
  pose.yaw_rad = std::atan2(ahead.y(), ahead.x());
  pose.yaw_rate_radps = at.yaw_rate_radps;
  return pose;
}

}  // namespace canyon::simulation
