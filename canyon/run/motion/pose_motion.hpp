#pragma once

#include <Eigen/Geometry>
#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/run/motion/trajectory.hpp"

namespace canyon::simulation {

/// An antenna at an instant, in the city's ENU frame.
struct AntennaState {
  Eigen::Vector3d position_enu_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_enu_mps = Eigen::Vector3d::Zero();
  double yaw_rad = 0;         ///< ENU yaw of the vehicle
  double yaw_rate_radps = 0;  ///< counter-clockwise
  /// The antenna follows a trajectory or stays at a place: it never jumps (LiveReceiver::observe()).
  bool continuous = false;
};

/// Whether an antenna is finite, within 10,000 km of the city's origin and not faster than 1000 km/s:
/// receivers take no other.
[[nodiscard]] bool is_possible(const AntennaState& antenna);

struct RigidPose {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();  ///< world from body
};
/// Whether places and quaternions differ by 1e-6 or less in each component.
[[nodiscard]] bool same_pose(const RigidPose& a, const RigidPose& b);

/// The yaw [rad] of a body's forward axis from the x axis, counter-clockwise, in (-pi, pi]. It has no meaning
/// where the body looks straight up or down.
[[nodiscard]] double yaw_of(const Eigen::Quaterniond& attitude);

/// A body's true motion in the frame of a host's world.
struct TruePose {
  RigidPose pose;
  Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();   ///< of the pose's origin [m/s]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s]
};

/// The antenna of a body: `lever_arm_m` from its origin (forward, left, up), turned with it.
/// @param heading_rad the turn of the frame of `body` in the city, about z
/// @param origin_enu_m the place of that frame's origin in the city
[[nodiscard]] AntennaState antenna_of(const TruePose& body, const Eigen::Vector3d& lever_arm_m,
                                      double heading_rad, const Eigen::Vector3d& origin_enu_m);

/// The same antenna in the city's frame; continuous.
[[nodiscard]] AntennaState antenna_state(const Pose& antenna, const geodesy::LocalFrame& frame);

/// Two poses that need a higher speed are a jump: the model was put elsewhere.
constexpr double kTeleport_mps = 1000;

/// The velocities that lead from one pose to another in `seconds` > 0, in the frame of the poses: along a
/// straight line, about one axis, the shorter way round. Both zero over jumps faster than kTeleport_mps.
/// `pose` of the result is `to`.
[[nodiscard]] TruePose motion_between(const RigidPose& from, const RigidPose& to, double seconds);
/// A body `seconds` later (or earlier, if negative) with the same velocities.
[[nodiscard]] TruePose moved_on(const TruePose& body, double seconds);

/// `pose` with a unit quaternion. Empty where it is not finite or its quaternion has no direction.
[[nodiscard]] std::optional<RigidPose> proper_pose(const RigidPose& pose);

/// A pose as received.
struct ReportedPose {
  RigidPose pose;
  double stamp_s = 0;  ///< by the sender's clock; a clock that does not run is ignored
  std::optional<Eigen::Vector3d> linear_velocity;   ///< [m/s]; empty: from poses
  std::optional<Eigen::Vector3d> angular_velocity;  ///< [rad/s], in the frame of the pose; empty: from poses
};

struct PoseTrackOptions {
  /// Age of the last pose [s of the host's time] up to which the body is assumed to move on.
  double timeout_s = 0.5;
  /// Shortest time over which poses are differenced for a velocity [s]: it averages the noise of measured
  /// poses.
  double smoothing_s = 0;
  /// True: a pose holds at its stamp, with the sender's clock estimated from the quickest messages, so that a
  /// late message is not taken for a later pose. False: it holds when it arrives.
  bool by_stamp = false;
};

/// The motion of a body whose poses arrive one by one: late, twice, out of order or not at all. Any thread
/// may add poses.
class PoseTrack {
 public:
  /// @param source for messages: "no pose has come on SOURCE yet"
  PoseTrack(std::string source, const PoseTrackOptions& options);

  enum class Taken {
    Yes,
    NoPose,  ///< not finite, or its quaternion has no direction (proper_pose())
    Old      ///< came before, or is older than the last
  };
  /// Adds a pose that arrives at `now_ns` of the host's time, unless it is refused. A stamp that goes back by
  /// more than the time-out belongs to another run of the sender: the track begins anew.
  Taken add(const ReportedPose& sent, std::int64_t now_ns);
  /// The motion at `now_ns`: between poses by the straight line, behind the last one as moved_on().
  /// Velocities are the sender's where it sends them, else differences of poses, by the sender's stamps where
  /// these go on, else by the host's time. Empty, with `reason`, where no pose has come, the last is too old,
  /// or the instant lies in a pause of more than two time-outs, behind the first of them. When time goes
  /// back, the poses received until then are dropped; by stamps they stay, since an instant may be asked for
  /// after its poses have come.
  [[nodiscard]] std::optional<TruePose> at(std::int64_t now_ns, std::string& reason);
  /// Whether a pose of `now_ns` or later is there.
  [[nodiscard]] bool reaches(std::int64_t now_ns) const;
  /// When the last pose came; empty: none has.
  [[nodiscard]] std::optional<std::int64_t> last_arrival_ns() const;
  void reset();

 private:
  struct Sample {
    std::int64_t arrival_ns = 0;
    double stamp_s = 0;
    TruePose motion;
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
  bool clock_runs_ = false;  // the sender's
  double offset_s_ = 0;      // host's time minus the sender's, by the quickest message
};

/// Poses of one body that come in any thread, each at the time of the host's latest step.
class PoseInbox {
 public:
  /// @param source for messages @param timeout_s as PoseTrackOptions
  PoseInbox(const std::string& source, double timeout_s) : source_(source), track_(source, {timeout_s}) {}

  /// Any thread. Returns what there is to say where the pose is none; only the first time, else nothing.
  [[nodiscard]] std::string take(const RigidPose& pose, double stamp_s);
  /// The host's time, in every step: a pose's age counts by it, since its stamp may be of another clock.
  void step(std::int64_t now_ns) { now_ns_ = now_ns; }
  /// As PoseTrack::at().
  [[nodiscard]] std::optional<TruePose> at(std::int64_t now_ns, std::string& reason);
  void reset();

 private:
  const std::string source_;
  PoseTrack track_;
  std::atomic<std::int64_t> now_ns_{0};
  std::atomic<bool> complained_{false};
};

/// The motion of a body that a physics engine knows. If something else moves a body that the engine has at
/// rest, velocities are differences of its poses.
class EngineMotion {
 public:
  /// `engine`: pose and velocities as the engine has them at `now_ns`; times in order, or begun anew. Empty
  /// where one is not finite.
  [[nodiscard]] std::optional<TruePose> at(std::int64_t now_ns, const TruePose& engine);
  void reset() { last_.reset(); }

 private:
  struct Sample {
    std::int64_t time_ns = 0;
    TruePose motion;
    bool at_rest = false;
  };
  std::optional<Sample> last_;
};

/// A smooth motion through poses that arrive one by one, for sensors that feel accelerations: quintic
/// B-splines (UniformSpline) through the poses at even steps, known up to three steps before the last one.
/// The path is a mean of poses with the variance step^2 / 2: in a bend it lies a step^2 / 4 inside, with the
/// acceleration a; jumps and noise of poses become pushes over some steps.
class SmoothPoses {
 public:
  /// @param frame of the poses; must outlive this
  /// @param step_s above 0; poses should come at least as often
  SmoothPoses(const geodesy::LocalFrame& frame, double step_s);

  [[nodiscard]] double step_s() const { return step_s_; }
  /// The instant up to which poses are needed for the motion at `at_ns` and 10 ms behind it.
  [[nodiscard]] std::int64_t needs_ns(std::int64_t at_ns) const;
  /// Takes the poses of the track up to the last one. Call it for each that comes, at `now_ns`. A pause in
  /// them, longer than the track bridges, ends the motion; it begins anew behind it.
  void follow(PoseTrack& track, std::int64_t now_ns);
  /// Takes what the motion at `at_ns` needs beyond the poses that have come: as the track moves them on.
  void reach(PoseTrack& track, std::int64_t at_ns);
  /// The longest time between two poses lately, where it is longer than the step [s].
  [[nodiscard]] std::optional<double> sparse_s() const;

  /// Whether the motion at `at_ns` is known.
  [[nodiscard]] bool holds(std::int64_t at_ns) const;
  /// Its first instant since the last pause [s]. Precondition: it holds at some instant.
  [[nodiscard]] double begin_s() const { return static_cast<double>(first_ + kAhead) * step_s_; }
  /// The body in the frame of the poses. Where the motion is not known it rests at its end.
  [[nodiscard]] TruePose at(double t_s) const;
  /// The same as the motion of a rigid body in ECEF, and as a pose at `time`.
  [[nodiscard]] EcefPose ecef_at(double t_s) const;
  [[nodiscard]] Pose pose_at(double t_s, geodesy::GpsTime time) const;

 private:
  struct Derivatives {
    TruePose body;
    Eigen::Vector3d acceleration;
  };
  /// Points before the first one: it moves there as between the first two.
  static constexpr std::int64_t kAhead = 3;
  void add(const TruePose& body);
  void forget();
  [[nodiscard]] Derivatives derivatives_at(double t_s) const;
  [[nodiscard]] std::int64_t next() const { return first_ + static_cast<std::int64_t>(points_.size()); }

  const geodesy::LocalFrame& frame_;
  double step_s_;
  std::int64_t step_ns_;
  std::deque<RigidPose> points_;  // their quaternions lie on one half of the sphere, each to the one before
  std::int64_t first_ = 0;        // points_[0] stands at first_ step_s_
  std::optional<std::int64_t> came_ns_;
  double longest_s_ = 0;
};

}  // namespace canyon::simulation
