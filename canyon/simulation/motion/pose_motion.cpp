#include "canyon/simulation/motion/pose_motion.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <utility>

namespace canyon::simulation {

using Eigen::Quaterniond;
using Eigen::Vector3d;

namespace {

constexpr std::size_t kMaxPoses = 64;
constexpr double kDrift = 200e-6;  // of a sender's clock: more than that of any crystal

double seconds(std::int64_t ns) {
  return static_cast<double>(ns) * 1e-9;
}

}  // namespace

PoseTrack::PoseTrack(std::string source, const PoseTrackOptions& options)
    : source_(std::move(source)), options_(options), timeout_ns_(std::llround(options.timeout_s * 1e9)) {}

PoseTrack::PoseResult PoseTrack::add(const ReportedPose& sent, std::int64_t now_ns) {
  const std::optional<RigidPose> pose = proper_pose(sent.pose);
  const auto finite = [](const std::optional<Vector3d>& v) { return !v || v->allFinite(); };
  if (!pose || !finite(sent.linear_velocity) || !finite(sent.angular_velocity) ||
      !std::isfinite(sent.stamp_s))
    return PoseResult::NoPose;
  const std::lock_guard lock(mutex_);
  if (!samples_.empty()) {
    const Sample& last = samples_.back();
    const double step_s = sent.stamp_s - last.stamp_s;
    if (step_s < 0 && clock_runs_) {
      if (step_s > -options_.timeout_s) return PoseResult::Old;
      samples_.clear();
      clock_runs_ = false;
    } else if (step_s == 0 && clock_runs_ && same_pose(*pose, last.motion)) {
      return PoseResult::Old;
    } else {
      clock_runs_ = step_s > 0;
    }
  }
  const double offset_s = seconds(now_ns) - sent.stamp_s;
  const double aged_s =
      samples_.empty() ? 0 : kDrift * std::max(0.0, seconds(now_ns - samples_.back().arrival_ns));
  // The sender's clock was set: its offset is unknown again.
  const bool set = std::abs(offset_s - offset_s_) > options_.timeout_s;
  offset_s_ = samples_.empty() || set ? offset_s : std::min(offset_s_ + aged_s, offset_s);
  Sample sample = after_last(sent, *pose, now_ns);
  if (options_.by_stamp && set) samples_.clear();
  samples_.push_back(std::move(sample));
  if (samples_.size() > kMaxPoses) samples_.pop_front();
  return PoseResult::Yes;
}

double PoseTrack::time_s(const Sample& sample) const {
  return options_.by_stamp && clock_runs_ ? sample.stamp_s + offset_s_ : seconds(sample.arrival_ns);
}

bool PoseTrack::reaches(std::int64_t now_ns) const {
  const std::lock_guard lock(mutex_);
  return !samples_.empty() && time_s(samples_.back()) >= seconds(now_ns);
}

std::optional<std::int64_t> PoseTrack::last_arrival_ns() const {
  const std::lock_guard lock(mutex_);
  if (samples_.empty()) return std::nullopt;
  return samples_.back().arrival_ns;
}

std::optional<RigidPose> PoseTrack::at(std::int64_t now_ns, std::string& reason) {
  const std::lock_guard lock(mutex_);
  const double now_s = seconds(now_ns);
  if (!options_.by_stamp && !samples_.empty() && samples_.back().arrival_ns > now_ns) samples_.clear();
  const auto later = std::find_if(samples_.begin(), samples_.end(),
                                  [&](const Sample& sample) { return time_s(sample) > now_s; });
  const double until_s = later == samples_.end() ? 0 : time_s(*later) - now_s;
  if (samples_.empty() || (later == samples_.begin() && until_s > options_.timeout_s)) {
    reason = fmt::format("no pose has come on {} yet", source_);
    return std::nullopt;
  }
  const std::int64_t age_ns = now_ns - samples_.back().arrival_ns;
  if (age_ns > timeout_ns_) {
    reason = fmt::format("the last pose on {} is {:.1f} s old", source_, seconds(age_ns));
    return std::nullopt;
  }
  if (later == samples_.begin()) return moved_on(later->motion, -until_s);
  const Sample& before = *(later - 1);
  const double ahead_s = now_s - time_s(before);
  if (later == samples_.end()) return moved_on(before.motion, std::min(ahead_s, options_.timeout_s));
  constexpr double kRounding_s = 1e-6;  // of stamps that are dates
  if (until_s > kRounding_s && ahead_s + until_s > 2 * options_.timeout_s + kRounding_s) {
    // In a pause, the later pose is not used.
    if (ahead_s <= options_.timeout_s + kRounding_s) return moved_on(before.motion, ahead_s);
    reason = fmt::format("the previous pose on {} is {:.1f} s old", source_, ahead_s);
    return std::nullopt;
  }
  const double fraction = ahead_s / (time_s(*later) - time_s(before));
  const auto mix = [fraction](const Vector3d& a, const Vector3d& b) -> Vector3d {
    return a + fraction * (b - a);
  };
  const RigidPose &a = before.motion, &b = later->motion;
  return RigidPose{mix(a.position_m, b.position_m), a.attitude.slerp(fraction, b.attitude),
                   mix(a.linear_velocity, b.linear_velocity), mix(a.angular_velocity, b.angular_velocity)};
}

void PoseTrack::reset() {
  const std::lock_guard lock(mutex_);
  samples_.clear();
}

PoseTrack::Sample PoseTrack::after_last(const ReportedPose& sent, const RigidPose& pose,
                                        std::int64_t arrival_ns) const {
  Sample sample{arrival_ns, sent.stamp_s, {pose.position_m, pose.attitude}};
  const auto from_poses = [&]() -> RigidPose {
    if (samples_.empty()) return sample.motion;
    const std::int64_t arrival_step_ns = arrival_ns - samples_.back().arrival_ns;
    // Poses on both sides of a pause, or of a jump back, are not differenced.
    if (arrival_step_ns < 0 || arrival_step_ns > timeout_ns_) return sample.motion;
    // By the sender's clock, if it advances; several messages may arrive within one step of simulated time.
    const auto since = [&](const Sample& earlier) {
      return clock_runs_ ? sent.stamp_s - earlier.stamp_s : seconds(arrival_ns - earlier.arrival_ns);
    };
    const Sample* from = &samples_.back();
    for (auto earlier = samples_.rbegin(); earlier != samples_.rend(); ++earlier) {
      if (since(*earlier) > options_.timeout_s) break;
      // Not across a jump.
      if (earlier != samples_.rbegin() && (from->motion.position_m - earlier->motion.position_m).norm() >
                                              kTeleport_mps * (since(*earlier) - since(*from)))
        break;
      from = &*earlier;
      if (since(*from) >= options_.smoothing_s) break;
    }
    const double step_s = since(*from);
    if (step_s > 0) return motion_between(from->motion, pose, step_s);
    if (same_pose(pose, samples_.back().motion)) return samples_.back().motion;  // the same message again
    return sample.motion;
  };
  if (!sent.linear_velocity || !sent.angular_velocity) sample.motion = from_poses();
  if (sent.linear_velocity) sample.motion.linear_velocity = *sent.linear_velocity;
  if (sent.angular_velocity) sample.motion.angular_velocity = *sent.angular_velocity;
  return sample;
}

std::string PoseInbox::take(const RigidPose& pose, double stamp_s) {
  if (track_.add({pose, stamp_s, {}, {}}, now_ns_) != PoseTrack::PoseResult::NoPose ||
      complained_.exchange(true))
    return {};
  return fmt::format(
      "poses on {} are dropped if they are not finite or their quaternion is zero; this is the first",
      source_);
}

std::optional<RigidPose> PoseInbox::at(std::int64_t now_ns, std::string& reason) {
  now_ns_ = now_ns;
  return track_.at(now_ns, reason);
}

void PoseInbox::reset() {
  track_.reset();
  now_ns_ = 0;  // poses that arrive before the host's next step belong to its new time
}

std::optional<RigidPose> EngineMotion::at(std::int64_t now_ns, const RigidPose& engine) {
  const std::optional<RigidPose> pose = proper_pose(engine);
  if (!pose || !engine.linear_velocity.allFinite() || !engine.angular_velocity.allFinite()) {
    last_.reset();
    return std::nullopt;
  }
  Sample sample{now_ns, *pose, engine.linear_velocity.isZero(0) && engine.angular_velocity.isZero(0)};
  if (last_ && now_ns < last_->time_ns) last_.reset();
  if (last_ && sample.at_rest && last_->at_rest) {
    const double seconds = static_cast<double>(now_ns - last_->time_ns) * 1e-9;
    if (seconds > 0)
      sample.motion = motion_between(last_->motion, *pose, seconds);
    else if (same_pose(*pose, last_->motion))
      sample.motion = last_->motion;  // called twice for one time
  }
  last_ = sample;
  return sample.motion;
}

}  // namespace canyon::simulation
