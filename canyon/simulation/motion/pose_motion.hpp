#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>

#include "canyon/simulation/motion/pose.hpp"

namespace canyon::simulation {

struct ReportedPose {
  RigidPose pose;
  double stamp_s = 0;  ///< by the sender's clock; ignored if that clock does not advance
  std::optional<Eigen::Vector3d> linear_velocity;   ///< [m/s]; empty: from poses
  std::optional<Eigen::Vector3d> angular_velocity;  ///< [rad/s], in the frame of the pose; empty: from poses
};

struct PoseTrackOptions {
  /// Age of the last pose [s of the host's time] up to which the body is extrapolated.
  double timeout_s = 0.5;
  /// Shortest time over which poses are differenced for a velocity [s]; averages the noise of measured poses.
  double smoothing_s = 0;
  /// True: a pose is valid at its stamp; the sender's clock is estimated from the messages with the least
  /// delay, so that a late message is not taken for a later pose. False: a pose is valid at its arrival.
  bool by_stamp = false;
};

/// The motion of a body whose poses arrive one by one, possibly late, repeated, out of order or not at all.
/// Any thread may add poses.
class PoseTrack {
 public:
  /// @param source name for messages: "no pose has come on SOURCE yet"
  PoseTrack(std::string source, const PoseTrackOptions& options);

  enum class PoseResult {
    Yes,
    NoPose,  ///< not finite, or its quaternion has no direction (proper_pose())
    Old      ///< duplicate, or older than the last
  };
  /// Adds a pose that arrives at `now_ns` of the host's time, unless it is rejected. A stamp that goes back
  /// by more than the time-out belongs to another run of the sender: the track restarts.
  PoseResult add(const ReportedPose& sent, std::int64_t now_ns);
  /// The motion at `now_ns`: linear between poses, extrapolated after the last one as moved_on(). Velocities
  /// are the sender's if given, else differences of poses: by the sender's stamps if these advance, else by
  /// the host's time. Empty, with `reason`, if no pose has come, the last is too old, or the instant is in a
  /// pause of more than two time-outs and more than one time-out after its start. If time goes back, the
  /// poses received until then are dropped; with by_stamp they are kept, since an instant may be requested
  /// after its poses have come.
  [[nodiscard]] std::optional<RigidPose> at(std::int64_t now_ns, std::string& reason);
  /// Whether a pose at `now_ns` or later has arrived.
  [[nodiscard]] bool reaches(std::int64_t now_ns) const;
  /// Arrival time of the last pose; empty: none has arrived.
  [[nodiscard]] std::optional<std::int64_t> last_arrival_ns() const;
  void reset();

 private:
  struct Sample {
    std::int64_t arrival_ns = 0;
    double stamp_s = 0;
    RigidPose motion;
  };
  [[nodiscard]] Sample after_last(const ReportedPose& sent, const RigidPose& pose,
                                  std::int64_t arrival_ns) const;
  /// Host's time of a sample [s].
  [[nodiscard]] double time_s(const Sample& sample) const;

  const std::string source_;
  const PoseTrackOptions options_;
  const std::int64_t timeout_ns_;  // whole, so that an age of exactly the time-out is not too old
  mutable std::mutex mutex_;
  std::deque<Sample> samples_;
  bool clock_runs_ = false;  // the sender's clock advances
  double offset_s_ = 0;      // host's time minus the sender's, by the message with the least delay
};

/// Poses of one body that arrive on any thread, each with the time of the host's latest step.
class PoseInbox {
 public:
  /// @param source for messages @param timeout_s as PoseTrackOptions
  PoseInbox(const std::string& source, double timeout_s) : source_(source), track_(source, {timeout_s}) {}

  /// Any thread. Returns a message if the pose is not valid, the first time only; else an empty text.
  [[nodiscard]] std::string take(const RigidPose& pose, double stamp_s);
  /// Sets the host's time, in every step. It measures a pose's age, whose stamp may be of another clock.
  void step(std::int64_t now_ns) { now_ns_ = now_ns; }
  /// As PoseTrack::at().
  [[nodiscard]] std::optional<RigidPose> at(std::int64_t now_ns, std::string& reason);
  void reset();

 private:
  const std::string source_;
  PoseTrack track_;
  std::atomic<std::int64_t> now_ns_{0};
  std::atomic<bool> complained_{false};
};

/// The motion of a body that a physics engine simulates. If something else moves a body that is at rest in
/// the engine, velocities are differences of its poses.
class EngineMotion {
 public:
  /// `engine`: pose and velocities of the engine at `now_ns`; times in order, or restarted. Empty if a value
  /// is not finite.
  [[nodiscard]] std::optional<RigidPose> at(std::int64_t now_ns, const RigidPose& engine);
  void reset() { last_.reset(); }

 private:
  struct Sample {
    std::int64_t time_ns = 0;
    RigidPose motion;
    bool at_rest = false;
  };
  std::optional<Sample> last_;
};

}  // namespace canyon::simulation
