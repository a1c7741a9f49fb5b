#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>

#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::simulation {

/// An antenna at an instant, in the city's ENU frame.
struct AntennaState {
  Eigen::Vector3d position_enu_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_enu_mps = Eigen::Vector3d::Zero();
  double yaw_rad = 0;         ///< ENU yaw of the vehicle
  double yaw_rate_radps = 0;  ///< counter-clockwise
  /// Of a trajectory or a fixed place: it is never put elsewhere (LiveReceiver::observe()).
  bool continuous = false;
};

struct RigidPose {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond attitude = Eigen::Quaterniond::Identity();  ///< world from body
};
/// Places and quaternions that differ by 1e-6 or less in each component.
[[nodiscard]] bool same_pose(const RigidPose& a, const RigidPose& b);

/// From the x axis, counter-clockwise, in (-pi, pi]; of a body that looks straight up or down it says
/// nothing.
[[nodiscard]] double yaw_of(const Eigen::Quaterniond& attitude);

/// A body's true motion in the frame of a host's world.
struct TruePose {
  RigidPose pose;
  Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();   ///< of the pose's origin [m/s]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s]
};

/// The antenna of a body: `lever_arm_m` from its origin (forward, left, up), turned with it.
/// @param enu_from_world of the frame that `body` is given in, about its z axis
/// @param origin_enu_m where that frame's origin stands in the city
[[nodiscard]] AntennaState antenna_of(const TruePose& body, const Eigen::Vector3d& lever_arm_m,
                                      double heading_rad, const Eigen::Vector3d& origin_enu_m);

/// The same antenna in the city's frame; continuous.
[[nodiscard]] AntennaState antenna_state(const Pose& antenna, const geodesy::LocalFrame& frame);

/// Faster than this between two poses is no motion but a jump: a model put elsewhere.
constexpr double kTeleport_mps = 1000;

/// The velocities that lead from one pose to another in `seconds` > 0, in the frame of the poses: along a
/// straight line, about one axis, the shorter way round. Both zero over jumps faster than kTeleport_mps.
/// `pose` of the result is `to`.
[[nodiscard]] TruePose motion_between(const RigidPose& from, const RigidPose& to, double seconds);
/// Where a body is `seconds` later, or earlier, if its velocities stay.
[[nodiscard]] TruePose moved_on(const TruePose& body, double seconds);

/// `pose` with a unit quaternion. Empty where it is not finite or its quaternion has no direction.
[[nodiscard]] std::optional<RigidPose> proper_pose(const RigidPose& pose);

/// A pose as received.
struct ReportedPose {
  RigidPose pose;
  double stamp_s = 0;  ///< of the sender's own clock; one that does not run counts as none
  std::optional<Eigen::Vector3d> linear_velocity;   ///< [m/s]; empty: from poses
  std::optional<Eigen::Vector3d> angular_velocity;  ///< [rad/s], in the frame of the pose; empty: from poses
};

struct PoseTrackOptions {
  /// A pose counts until so much of the host's time has passed since it came; until then the body goes on as
  /// it moved.
  double timeout_s = 0.5;
  /// Where velocities are differences of poses: over so much time at least, which averages the noise of
  /// measured poses.
  double smoothing_s = 0;
  /// When a pose was true: at its stamp, on the sender's clock as the quickest messages show it, so that what
  /// comes late is not taken for later (false: when it came).
  bool by_stamp = false;
};

/// The motion of a body whose poses come from outside, one by one: late, twice, out of order or not at all.
/// Poses may come from any thread.
class PoseTrack {
 public:
  /// @param source for messages: "no pose has come on SOURCE yet"
  PoseTrack(std::string source, const PoseTrackOptions& options);

  enum class Taken {
    Yes,
    NoPose,  ///< not finite, or its quaternion has no direction (proper_pose())
    Old      ///< came before, or is older than the last
  };
  /// A pose that comes at `now_ns` of the host's time; dropped unless it is taken. A stamp that went back by
  /// more than the time-out is another run of the sender, and begins anew.
  Taken add(const ReportedPose& sent, std::int64_t now_ns);
  /// The motion at `now_ns`: between poses by the straight line, behind the last one as moved_on().
  /// Velocities are the sender's where it sends them, else differences of poses, by the sender's stamps where
  /// these go on, else by the host's time. Empty, with `reason`, where no pose has come or the last is too
  /// old. When time goes back, the poses received until then are dropped.
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
  double offset_s_ = 0;      // host's time less the sender's, of the quickest message
};

}  // namespace canyon::simulation
