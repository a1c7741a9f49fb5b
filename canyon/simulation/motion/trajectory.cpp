#include "canyon/simulation/motion/trajectory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/simulation/motion/smooth_drive.hpp"
#include "canyon/simulation/motion/smooth_motion.hpp"

namespace canyon::simulation {

using geodesy::Geodetic;
using geodesy::GpsTime;

namespace {

using Samples = std::vector<std::pair<GpsTime, Geodetic>>;
constexpr double kGravity_mps2 = 9.80665;

Samples straight_samples(GpsTime start, const std::vector<Waypoint>& waypoints) {
  Samples samples;
  GpsTime t = start;
  Eigen::Vector3d previous = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < waypoints.size(); ++i) {
    const Waypoint& waypoint = waypoints[i];
    const Eigen::Vector3d ecef = geodesy::ecef_from_geodetic(waypoint.position);
    if (i > 0) {
      const double duration_s = (ecef - previous).norm() / waypoint.speed_mps;
      if (!(duration_s < 1e8)) {
        throw InputError(fmt::format("the leg to waypoint {} takes {:.0f} s", i + 1, duration_s),
                         "check the waypoint and speed_mps");
      }
      t = t + duration_s;
    }
    // Two waypoints at one position count as one; their holds add up.
    if (samples.empty() || t > samples.back().first) samples.emplace_back(t, waypoint.position);
    t = t + waypoint.hold_s;
    if (t > samples.back().first) samples.emplace_back(t, waypoint.position);
    previous = ecef;
  }
  return samples;
}

/// Weight of a vehicle's attitude at rest, by speed [m/s]: below 1e-6 from 4 m/s on. Smooth.
double fraction_of_rest(const Eigen::Vector3d& velocity_mps) {
  return 2 * std::exp(-velocity_mps.head<2>().squaredNorm());
}

// Sets roll and pitch from the acceleration; the yaw is already set.
void set_attitude(Pose& pose, Attitude attitude) {
  const Eigen::Vector3d& v = pose.velocity_enu_mps;
  if (attitude == Attitude::Aircraft) {
    const double level_mps = v.head<2>().norm();
    if (level_mps < Trajectory::kStandstill_mps) return;
    pose.roll_rad = -std::atan(level_mps * pose.yaw_rate_radps / kGravity_mps2);
    pose.pitch_rad = std::atan2(v.z(), level_mps);
  } else if (attitude == Attitude::Multirotor) {
    const Eigen::Vector3d up =
        (pose.acceleration_enu_mps2 + kGravity_mps2 * Eigen::Vector3d::UnitZ()).normalized();
    const double c = std::cos(pose.yaw_rad), s = std::sin(pose.yaw_rad);
    pose.roll_rad = -std::asin(std::clamp(-s * up.x() + c * up.y(), -1.0, 1.0));
    pose.pitch_rad = std::atan2(-(c * up.x() + s * up.y()), up.z());
  } else if (attitude == Attitude::Car) {
    pose.pitch_rad = std::atan2(v.z(), std::hypot(v.head<2>().norm(), fraction_of_rest(v)));
  }
}

/// The heading of a smooth motion: of travel; towards rest it approaches the motion's own yaw. Twice
/// continuously differentiable.
void set_smooth_yaw(Pose& pose, double yaw_rad, double yaw_rate_radps) {
  const Eigen::Vector2d v = pose.velocity_enu_mps.head<2>(), a = pose.acceleration_enu_mps2.head<2>();
  const Eigen::Vector2d held(std::cos(yaw_rad), std::sin(yaw_rad));
  const double fraction = fraction_of_rest(pose.velocity_enu_mps);
  const Eigen::Vector2d sum = v + fraction * held;
  const Eigen::Vector2d rate =
      a + fraction * (yaw_rate_radps * Eigen::Vector2d(-held.y(), held.x()) - 2 * v.dot(a) * held);
  pose.yaw_rad = std::atan2(sum.y(), sum.x());
  pose.yaw_rate_radps = (sum.x() * rate.y() - sum.y() * rate.x()) / sum.squaredNorm();
}

}  // namespace

struct Trajectory::Track {
  std::vector<GpsTime> times;
  std::vector<Geodetic> geodetic_positions;
  geodesy::LocalFrame frame;                // about the first position
  std::vector<Eigen::Vector3d> positions;   // in `frame`
  std::vector<Eigen::Vector3d> velocities;  // in `frame`, at the samples; cubic segments only
  std::vector<double> held_yaw;             // per sample: yaw while stationary from there on
  double sample_interval_s = 1;
  bool all_straight = false;
  std::optional<SmoothMotion> motion;  // in `frame`, seconds from `motion_begin`, instead of the samples
  GpsTime motion_begin;
  double length_m = 0;

  Track(const std::vector<std::pair<GpsTime, Geodetic>>& samples, bool straight) : all_straight(straight) {
    if (samples.empty()) throw InputError("the trajectory is empty", "it needs at least one position");
    times.reserve(samples.size());
    geodetic_positions.reserve(samples.size());
    for (const auto& [time, geodetic] : samples) {
      geodesy::check_geodetic(geodetic, "trajectory");
      if (!times.empty() && time <= times.back()) {
        throw InputError(fmt::format("trajectory: the time {} does not follow {}", format_gpst(time, 3),
                                     format_gpst(times.back(), 3)),
                         "times must increase strictly");
      }
      times.push_back(time);
      geodetic_positions.push_back(geodetic);
    }
    frame = geodesy::LocalFrame(geodetic_positions.front());
    positions.reserve(geodetic_positions.size());
    for (const Geodetic& geodetic : geodetic_positions)
      positions.push_back(frame.local_from_geodetic(geodetic));
    for (std::size_t i = 0; i + 1 < positions.size(); ++i)
      length_m += (positions[i + 1] - positions[i]).norm();
    set_velocities();
    set_held_yaws();
  }

  [[nodiscard]] double spacing(std::size_t i) const { return times[i + 1] - times[i]; }
  [[nodiscard]] bool is_straight(std::size_t segment) const {
    return all_straight || spacing(segment) > kMaxCubicGap_s;
  }
  [[nodiscard]] bool is_pause(std::size_t segment) const {
    constexpr double kStill_m = 1;
    return !all_straight && spacing(segment) > std::max(kMaxCubicGap_s, 10 * sample_interval_s) &&
           (positions[segment + 1] - positions[segment]).norm() > kStill_m;
  }
  [[nodiscard]] Eigen::Vector3d chord_velocity(std::size_t segment) const {
    return (positions[segment + 1] - positions[segment]) / spacing(segment);
  }
  // Derivative of the parabola through a sample and its neighbours; one-sided at straight gaps and ends.
  void set_velocities() {
    const std::size_t n = positions.size();
    if (all_straight || n < 2) return;
    velocities.assign(n, Eigen::Vector3d::Zero());
    for (std::size_t i = 0; i < n; ++i) {
      const bool before = i > 0 && !is_straight(i - 1);
      const bool after = i + 1 < n && !is_straight(i);
      if (before && after) {
        const double h0 = spacing(i - 1);
        const double h1 = spacing(i);
        velocities[i] = (h1 * chord_velocity(i - 1) + h0 * chord_velocity(i)) / (h0 + h1);
      } else if (before) {
        // The parabola through the last three samples, if there are three.
        velocities[i] = chord_velocity(i - 1);
        if (i >= 2 && !is_straight(i - 2)) {
          const double h0 = spacing(i - 2);
          const double h1 = spacing(i - 1);
          velocities[i] += (chord_velocity(i - 1) - chord_velocity(i - 2)) * h1 / (h0 + h1);
        }
      } else if (after) {
        velocities[i] = chord_velocity(i);
        if (i + 2 < n && !is_straight(i + 1)) {
          const double h0 = spacing(i);
          const double h1 = spacing(i + 1);
          velocities[i] -= (chord_velocity(i + 1) - chord_velocity(i)) * h0 / (h0 + h1);
        }
      }
    }
  }

  void set_held_yaws() {
    const std::size_t n = positions.size();
    held_yaw.assign(n, 0);
    const auto velocity = [this](std::size_t i) -> Eigen::Vector3d {
      if (positions.size() < 2) return Eigen::Vector3d::Zero();
      const std::size_t segment = std::min(i, positions.size() - 2);
      const Eigen::Vector3d local = is_straight(segment) ? chord_velocity(segment) : velocities[i];
      return geodesy::enu_from_ecef_rotation(geodetic_positions[i]) *
             (frame.ecef_from_local_rotation() * local);
    };
    std::size_t first_moving = n;
    double yaw = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector3d v = velocity(i);
      if (v.head<2>().norm() >= kStandstill_mps) {
        yaw = std::atan2(v.y(), v.x());
        first_moving = std::min(first_moving, i);
      }
      held_yaw[i] = yaw;
    }
    // Before its first movement a vehicle has the heading of that movement.
    if (first_moving < n) std::fill_n(held_yaw.begin(), first_moving, held_yaw[first_moving]);
  }

  [[nodiscard]] Pose at(GpsTime t, Attitude attitude) const {
    t = std::clamp(t, times.front(), times.back());
    if (motion) return in_motion(t, attitude);
    if (times.size() == 1) {
      Pose pose;
      pose.time = t;
      pose.position = geodetic_positions.front();
      return pose;
    }
    const auto after = std::upper_bound(times.begin(), times.end(), t);
    const auto index = static_cast<std::size_t>(after - times.begin());
    return in_segment(std::min(index, times.size() - 1) - 1, t, attitude);
  }

  [[nodiscard]] Pose in_segment(std::size_t i, GpsTime t, Attitude attitude) const {
    const double h = spacing(i);
    const double s = (t - times[i]) / h;
    const Eigen::Vector3d& p0 = positions[i];
    const Eigen::Vector3d& p1 = positions[i + 1];
    Eigen::Vector3d position;
    Eigen::Vector3d velocity;
    Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
    const bool straight = is_straight(i);
    if (straight) {
      position = p0 + s * (p1 - p0);
      velocity = (p1 - p0) / h;
    } else {
      const Eigen::Vector3d m0 = h * velocities[i];
      const Eigen::Vector3d m1 = h * velocities[i + 1];
      // Hermite's cubic as p0 + s m0 + s^2 c2 + s^3 c3.
      const Eigen::Vector3d c2 = 3 * (p1 - p0) - 2 * m0 - m1;
      const Eigen::Vector3d c3 = 2 * (p0 - p1) + m0 + m1;
      position = p0 + s * (m0 + s * (c2 + s * c3));
      velocity = (m0 + s * (2 * c2 + 3 * s * c3)) / h;
      acceleration = (2 * c2 + 6 * s * c3) / (h * h);
    }

    Pose pose;
    pose.time = t;
    if (t == times[i]) {
      pose.position = geodetic_positions[i];
    } else if (t == times[i + 1]) {
      pose.position = geodetic_positions[i + 1];
    } else {
      pose.position = frame.geodetic_from_local(position);
      // A chord of many kilometres would run below the ellipsoid's surface.
      if (straight)
        pose.position.height_m = geodetic_positions[i].height_m +
                                 s * (geodetic_positions[i + 1].height_m - geodetic_positions[i].height_m);
    }
    const Eigen::Matrix3d enu_from_frame =
        geodesy::enu_from_ecef_rotation(pose.position) * frame.ecef_from_local_rotation();
    pose.velocity_enu_mps = enu_from_frame * velocity;
    pose.acceleration_enu_mps2 = enu_from_frame * acceleration;
    if (straight)
      pose.velocity_enu_mps.z() = (geodetic_positions[i + 1].height_m - geodetic_positions[i].height_m) / h;

    const Eigen::Vector3d& v = pose.velocity_enu_mps;
    const Eigen::Vector3d& a = pose.acceleration_enu_mps2;
    const double speed_squared = v.head<2>().squaredNorm();
    if (speed_squared >= kStandstill_mps * kStandstill_mps) {
      pose.yaw_rad = std::atan2(v.y(), v.x());
      pose.yaw_rate_radps = (v.x() * a.y() - v.y() * a.x()) / speed_squared;
    } else {
      pose.yaw_rad = held_yaw[i];
    }
    set_attitude(pose, attitude);
    return pose;
  }

  [[nodiscard]] Pose in_motion(GpsTime t, Attitude attitude) const {
    const SmoothMotion::Point point = motion->at(t - motion_begin);
    Pose pose;
    pose.time = t;
    pose.position = frame.geodetic_from_local(point.position);
    const Eigen::Matrix3d enu_from_frame =
        geodesy::enu_from_ecef_rotation(pose.position) * frame.ecef_from_local_rotation();
    pose.velocity_enu_mps = enu_from_frame * point.velocity;
    pose.acceleration_enu_mps2 = enu_from_frame * point.acceleration;
    set_smooth_yaw(pose, point.yaw_rad, point.yaw_rate_radps);
    set_attitude(pose, attitude);
    return pose;
  }

  /// Precondition: there is a `motion`.
  [[nodiscard]] EcefPose ecef_pose(GpsTime t, Attitude attitude) const {
    const SmoothMotion::Point point = motion->at(std::clamp(t, times.front(), times.back()) - motion_begin);
    const Eigen::Matrix3d& ecef_from_frame = frame.ecef_from_local_rotation();
    EcefPose result;
    result.position_m = frame.ecef_from_local(point.position);
    result.velocity_mps = ecef_from_frame * point.velocity;
    result.acceleration_mps2 = ecef_from_frame * point.acceleration;
    const Eigen::Matrix3d enu_from_ecef = enu_from_ecef_at(result.position_m);
    Pose pose;
    pose.velocity_enu_mps = enu_from_ecef * result.velocity_mps;
    pose.acceleration_enu_mps2 = enu_from_ecef * result.acceleration_mps2;
    set_smooth_yaw(pose, point.yaw_rad, point.yaw_rate_radps);
    set_attitude(pose, attitude);
    result.ecef_from_body = enu_from_ecef.transpose() * enu_from_body(pose);
    return result;
  }
};

Trajectory::Trajectory(std::vector<std::pair<GpsTime, Geodetic>> samples) {
  auto track = std::make_shared<Track>(std::move(samples), false);
  std::vector<double> spacings;
  for (std::size_t i = 0; i + 1 < track->times.size(); ++i) spacings.push_back(track->spacing(i));
  if (!spacings.empty()) {
    const auto middle = spacings.begin() + static_cast<std::ptrdiff_t>(spacings.size() / 2);
    std::nth_element(spacings.begin(), middle, spacings.end());
    track->sample_interval_s = *middle;
  }
  track_ = std::move(track);
}

Trajectory Trajectory::from_waypoints(GpsTime start, const std::vector<Waypoint>& waypoints,
                                      std::optional<double> acceleration_mps2) {
  if (waypoints.empty()) throw InputError("the list of waypoints is empty", "give at least one");
  for (std::size_t i = 0; i < waypoints.size(); ++i) {
    const Waypoint& w = waypoints[i];
    geodesy::check_geodetic(w.position, fmt::format("waypoint {}", i + 1).c_str());
    if (!(w.speed_mps > 0) || !(w.speed_mps <= 1e5)) {
      throw InputError(fmt::format("speed_mps: {} m/s is out of range", w.speed_mps),
                       "give a value above 0, at most 100000 m/s");
    }
    if (!(w.hold_s >= 0) || !(w.hold_s <= 1e8))
      throw InputError(fmt::format("hold_s: {} s is out of range", w.hold_s), "give 0 to 1e8 s");
  }
  Trajectory trajectory(Samples{{start, waypoints.front().position}});
  if (acceleration_mps2 && waypoints.size() > 1) {
    SmoothDrive drive = smooth_drive(waypoints, *acceleration_mps2);
    if (drive.length_m > 0) {
      auto track = std::make_shared<Track>(
          Samples{{start, waypoints.front().position}, {start + drive.duration_s, waypoints.back().position}},
          true);
      track->motion = std::move(drive.motion);
      track->motion_begin = start;
      track->length_m = drive.length_m;
      trajectory.track_ = std::move(track);
      return trajectory;
    }
  }
  trajectory.track_ = std::make_shared<Track>(straight_samples(start, waypoints), true);
  return trajectory;
}

bool Trajectory::smooth() const {
  return track_->motion || track_->length_m == 0;
}

Trajectory Trajectory::smoothed(const std::function<Pose(GpsTime)>& pose) const {
  auto track = std::make_shared<Track>(*track_);
  if (begin() == end()) return *this;
  const Pose first = pose(begin()), last = pose(end());
  track->frame = geodesy::LocalFrame(first.position);
  const double duration_s = end() - begin();
  double yaw = first.yaw_rad;
  const auto distance = [&](double t) {
    const Pose at = t < 0 ? first : t > duration_s ? last : pose(begin() + t);
    MotionKnot knot{track->frame.local_from_geodetic(at.position)};
    const double beyond_s = t - std::clamp(t, 0.0, duration_s);
    if (beyond_s != 0) {
      const Eigen::Matrix3d frame_from_enu = track->frame.ecef_from_local_rotation().transpose() *
                                             geodesy::enu_from_ecef_rotation(at.position).transpose();
      knot.position += beyond_s * (frame_from_enu * at.velocity_enu_mps);
    }
    constexpr double kMoving_mps = 1;
    if (at.velocity_enu_mps.head<2>().norm() > kMoving_mps)
      yaw += std::remainder(at.yaw_rad - yaw, 2 * geodesy::kPi);
    knot.yaw_rad = yaw;
    return knot;
  };
  SmoothMotion motion;
  motion.add(0, duration_s, distance);
  track->motion = std::move(motion);
  track->motion_begin = begin() + (-SmoothMotion::kReach_s);
  Trajectory smooth = *this;
  smooth.track_ = std::move(track);
  return smooth;
}

Trajectory Trajectory::fixed(GpsTime start, const Geodetic& position, double duration_s) {
  if (!(duration_s >= 0) || !(duration_s <= 1e9))
    throw InputError(fmt::format("duration_s: {} s is out of range", duration_s), "give 0 to 1e9 s");
  std::vector<std::pair<GpsTime, Geodetic>> samples{{start, position}};
  if (start + duration_s > start) samples.emplace_back(start + duration_s, position);
  Trajectory trajectory(std::vector<std::pair<GpsTime, Geodetic>>{samples.front()});
  trajectory.track_ = std::make_shared<Track>(std::move(samples), true);
  return trajectory;
}

GpsTime Trajectory::begin() const {
  return track_->times.front();
}
GpsTime Trajectory::end() const {
  return track_->times.back();
}
double Trajectory::sample_interval_s() const {
  return track_->sample_interval_s;
}
Pose Trajectory::at(GpsTime t) const {
  return track_->at(t, attitude_);
}

Trajectory Trajectory::with_attitude(Attitude attitude) const {
  Trajectory tilted = *this;
  tilted.attitude_ = attitude;
  return tilted;
}

std::vector<std::pair<GpsTime, GpsTime>> Trajectory::pauses() const {
  std::vector<std::pair<GpsTime, GpsTime>> pauses;
  for (std::size_t i = 0; i + 1 < track_->times.size(); ++i)
    if (track_->is_pause(i)) pauses.emplace_back(track_->times[i], track_->times[i + 1]);
  return pauses;
}

bool Trajectory::covers(GpsTime t) const {
  if (t < begin() || t > end()) return false;
  const auto after = std::lower_bound(track_->times.begin(), track_->times.end(), t);
  return *after == t || !track_->is_pause(static_cast<std::size_t>(after - track_->times.begin()) - 1);
}

EcefPose Trajectory::ecef_pose(GpsTime t) const {
  return track_->motion ? track_->ecef_pose(t, attitude_) : body_state(at(t));
}

double Trajectory::length_m() const {
  return track_->length_m;
}

}  // namespace canyon::simulation
