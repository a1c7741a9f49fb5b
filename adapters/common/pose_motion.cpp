#include "adapters/common/pose_motion.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <cmath>
#include <utility>

namespace canyon::adapters {

using Eigen::Quaterniond;
using Eigen::Vector3d;

namespace {

double seconds(std::int64_t ns) {
  return static_cast<double>(ns) * 1e-9;
}

}  // namespace

bool same_pose(const RigidPose& a, const RigidPose& b) {
  return (a.position_m - b.position_m).cwiseAbs().maxCoeff() <= 1e-6 &&
         (a.attitude.coeffs() - b.attitude.coeffs()).cwiseAbs().maxCoeff() <= 1e-6;
}

double yaw_of(const Quaterniond& q) {
  return std::atan2(2 * (q.x() * q.y() + q.w() * q.z()),
                    q.w() * q.w() + q.x() * q.x() - q.y() * q.y() - q.z() * q.z());
}

TruePose motion_between(const RigidPose& from, const RigidPose& to, double seconds) {
  TruePose motion{to, Vector3d::Zero(), Vector3d::Zero()};
  const Vector3d way = to.position_m - from.position_m;
  if (!(way.norm() <= kTeleport_mps * seconds)) return motion;
  motion.linear_velocity = way / seconds;
  Quaterniond turn = to.attitude * from.attitude.inverse();
  if (turn.w() < 0) turn.coeffs() *= -1;  // the same turn, the shorter way
  const double sine = turn.vec().norm();
  if (sine > 0) motion.angular_velocity = turn.vec() * (2 * std::atan2(sine, turn.w()) / sine / seconds);
  return motion;
}

std::optional<RigidPose> proper_pose(const RigidPose& pose) {
  const double norm = pose.attitude.norm();
  if (!std::isfinite(norm) || !pose.position_m.allFinite() || norm < 1e-6) return std::nullopt;
  RigidPose proper = pose;
  proper.attitude.coeffs() /= norm;
  return proper;
}

std::optional<TruePose> EngineMotion::at(std::int64_t now_ns, const TruePose& engine) {
  const std::optional<RigidPose> pose = proper_pose(engine.pose);
  if (!pose || !engine.linear_velocity.allFinite() || !engine.angular_velocity.allFinite()) {
    last_.reset();
    return std::nullopt;
  }
  Sample sample{now_ns,
                {*pose, engine.linear_velocity, engine.angular_velocity},
                engine.linear_velocity.isZero(0) && engine.angular_velocity.isZero(0)};
  if (last_ && now_ns < last_->time_ns) last_.reset();
  if (last_ && sample.at_rest && last_->at_rest) {
    const double seconds = static_cast<double>(now_ns - last_->time_ns) * 1e-9;
    if (seconds > 0) {
      sample.motion = motion_between(last_->motion.pose, *pose, seconds);
    } else if (same_pose(*pose, last_->motion.pose)) {
      sample.motion = last_->motion;  // asked twice at one time
    }
  }
  last_ = sample;
  return sample.motion;
}

PoseTrack::PoseTrack(std::string topic, double timeout_s)
    : topic_(std::move(topic)), timeout_ns_(std::llround(timeout_s * 1e9)) {}

bool PoseTrack::add(const RigidPose& raw, double stamp_s, std::int64_t now_ns) {
  const std::optional<RigidPose> pose = proper_pose(raw);
  if (!pose) return false;
  const std::lock_guard lock(mutex_);
  last_ = after_last(*pose, stamp_s, now_ns);
  return true;
}

std::optional<TruePose> PoseTrack::at(std::int64_t now_ns, std::string& reason) {
  const std::lock_guard lock(mutex_);
  if (last_ && last_->arrival_ns > now_ns) last_.reset();
  if (!last_) {
    reason = fmt::format("no pose has come on {} yet", topic_);
    return std::nullopt;
  }
  const std::int64_t age_ns = now_ns - last_->arrival_ns;
  if (age_ns > timeout_ns_) {
    reason = fmt::format("the last pose on {} is {:.1f} s old", topic_, seconds(age_ns));
    return std::nullopt;
  }
  return last_->motion;
}

void PoseTrack::reset() {
  const std::lock_guard lock(mutex_);
  last_.reset();
}

PoseTrack::Sample PoseTrack::after_last(const RigidPose& pose, double stamp_s,
                                        std::int64_t arrival_ns) const {
  Sample sample{arrival_ns, stamp_s, {pose, Vector3d::Zero(), Vector3d::Zero()}};
  if (!last_) return sample;
  const std::int64_t arrival_step_ns = arrival_ns - last_->arrival_ns;
  // A difference across a time without truth, or from before a jump back, is no velocity.
  if (arrival_step_ns < 0 || arrival_step_ns > timeout_ns_) return sample;
  // The sender's clock, if it runs; several messages may come within one step of simulated time.
  const double stamp_step_s = stamp_s - last_->stamp_s;
  const double step_s = stamp_step_s > 0 ? stamp_step_s : seconds(arrival_step_ns);
  if (step_s > 0) {
    sample.motion = motion_between(last_->motion.pose, pose, step_s);
  } else if (same_pose(pose, last_->motion.pose)) {
    sample.motion = last_->motion;  // the same message again
  }
  return sample;
}

}  // namespace canyon::adapters
