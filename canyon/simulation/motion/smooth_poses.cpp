#include "canyon/simulation/motion/smooth_poses.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "canyon/base/arithmetic.hpp"
#include "canyon/simulation/motion/smooth_motion.hpp"

namespace canyon::simulation {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr std::int64_t kMargin_ns = 10'000'000;  // look-ahead of sensors
constexpr double kKept_s = 12;                   // more than the delay of any sensor

}  // namespace

SmoothPoses::SmoothPoses(const geodesy::LocalFrame& frame, double step_s)
    : frame_(frame), step_s_(step_s), step_ns_(std::llround(step_s * 1e9)) {
  step_s_ = static_cast<double>(step_ns_) * 1e-9;
}

std::int64_t SmoothPoses::needs_ns(std::int64_t at_ns) const {
  return (floor_div(at_ns + kMargin_ns, step_ns_) + kAhead) * step_ns_;
}

void SmoothPoses::follow(PoseTrack& track, std::int64_t now_ns) {
  const bool first = !came_ns_;
  if (came_ns_) {
    const double since_s = static_cast<double>(now_ns - *came_ns_) * 1e-9;
    longest_s_ = std::max(since_s, longest_s_ * std::exp(-since_s / 2));
  }
  came_ns_ = now_ns;
  // The track bridges half a second.
  constexpr std::int64_t kPause_ns = 400'000'000;
  if (first || now_ns - next() * step_ns_ > std::max(2 * step_ns_, kPause_ns)) {
    forget();
    first_ = -floor_div(-now_ns, step_ns_);
  }
  std::string reason;
  while (track.reaches(next() * step_ns_)) {
    const std::optional<RigidPose> body = track.at(next() * step_ns_, reason);
    if (!body) return forget();
    add(*body);
  }
}

void SmoothPoses::reach(PoseTrack& track, std::int64_t at_ns) {
  std::string reason;
  while (!points_.empty() && next() * step_ns_ <= needs_ns(at_ns)) {
    const std::optional<RigidPose> body = track.at(next() * step_ns_, reason);
    if (!body) return forget();
    add(*body);
  }
}

std::optional<double> SmoothPoses::sparse_s() const {
  constexpr double kSlack = 1.5;
  if (longest_s_ <= kSlack * step_s_) return std::nullopt;
  return longest_s_;
}

void SmoothPoses::add(const RigidPose& body) {
  if (points_.empty()) {
    points_.push_back(body);
    return;
  }
  RigidPose pose = body;
  if (pose.attitude.dot(points_.back().attitude) < 0) pose.attitude.coeffs() *= -1;
  if ((pose.position_m - points_.back().position_m).norm() > kTeleport_mps * step_s_) {
    // A jump.
    const std::int64_t here = next();
    forget();
    first_ = here;
    return add(body);
  }
  if (points_.size() == 1) {
    const RigidPose begin = motion_between(points_.front(), pose, step_s_);
    const RigidPose at_first{points_.front().position_m, points_.front().attitude, begin.linear_velocity,
                             begin.angular_velocity};
    for (std::int64_t k = 1; k <= kAhead; ++k) {
      RigidPose before = moved_on(at_first, -static_cast<double>(k) * step_s_);
      if (before.attitude.dot(points_.front().attitude) < 0) before.attitude.coeffs() *= -1;
      points_.push_front(before);
    }
    first_ -= kAhead;
  }
  points_.push_back(pose);
  while (static_cast<double>(points_.size()) * step_s_ > kKept_s) {
    points_.pop_front();
    ++first_;
  }
}

void SmoothPoses::forget() {
  points_.clear();
}

bool SmoothPoses::holds(std::int64_t at_ns) const {
  return !points_.empty() && at_ns >= (first_ + kAhead) * step_ns_ && needs_ns(at_ns) < next() * step_ns_;
}

SmoothPoses::Derivatives SmoothPoses::derivatives_at(double t_s) const {
  if (points_.empty()) return {{}, Vector3d::Zero()};
  // The six points around the instant.
  constexpr std::int64_t kBefore = 2, kPoints = 6;
  const auto from = static_cast<std::int64_t>(std::floor(t_s / step_s_)) - kBefore;
  std::vector<UniformSpline::Value> points, attitudes;
  for (std::int64_t k = from; k < from + kPoints; ++k) {
    const auto last = static_cast<std::int64_t>(points_.size()) - 1;
    const RigidPose& point = points_[static_cast<std::size_t>(std::clamp<std::int64_t>(k - first_, 0, last))];
    points.emplace_back(point.position_m.x(), point.position_m.y(), point.position_m.z(), 0);
    attitudes.push_back(point.attitude.coeffs());
  }
  const double since_s = t_s - static_cast<double>(from) * step_s_;
  const UniformSpline::Point position = UniformSpline(std::move(points), step_s_).at(since_s);
  const UniformSpline::Point rotation = UniformSpline(std::move(attitudes), step_s_).at(since_s);
  Derivatives result;
  result.body.position_m = position.value.head<3>();
  result.body.linear_velocity = position.rate.head<3>();
  result.acceleration = position.acceleration.head<3>();
  const double length = rotation.value.norm();
  const Eigen::Vector4d unit = rotation.value / length;
  Quaterniond rate;
  rate.coeffs() = (rotation.rate - unit * unit.dot(rotation.rate)) / length;
  result.body.attitude.coeffs() = unit;
  result.body.angular_velocity = 2 * (rate * result.body.attitude.conjugate()).vec();
  return result;
}

RigidPose SmoothPoses::at(double t_s) const {
  return derivatives_at(t_s).body;
}

EcefPose SmoothPoses::ecef_at(double t_s) const {
  const Derivatives motion = derivatives_at(t_s);
  const Eigen::Matrix3d& rotation = frame_.ecef_from_local_rotation();
  return {frame_.ecef_from_local(motion.body.position_m), rotation * motion.body.linear_velocity,
          rotation * motion.acceleration, rotation * motion.body.attitude.toRotationMatrix()};
}

Pose SmoothPoses::pose_at(double t_s, geodesy::GpsTime time) const {
  const Derivatives motion = derivatives_at(t_s);
  Pose pose = pose_of(motion.body, {frame_}, time);
  pose.acceleration_enu_mps2 = geodesy::enu_from_ecef_rotation(pose.position) *
                               (frame_.ecef_from_local_rotation() * motion.acceleration);
  return pose;
}

}  // namespace canyon::simulation
