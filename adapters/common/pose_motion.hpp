#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

namespace canyon::adapters {

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

/// Faster than this between two poses is no motion but a jump: a model put elsewhere.
constexpr double kTeleport_mps = 1000;

/// The velocities that lead from one pose to another in `seconds` > 0, in the frame of the poses: along a
/// straight line, about one axis, the shorter way round. Both zero over jumps faster than kTeleport_mps.
/// `pose` of the result is `to`.
[[nodiscard]] TruePose motion_between(const RigidPose& from, const RigidPose& to, double seconds);

/// `pose` with a unit quaternion. Empty where it is not finite or its quaternion has no direction.
[[nodiscard]] std::optional<RigidPose> proper_pose(const RigidPose& pose);

/// The motion of a body that a physics engine knows. What the engine has at rest may be moved by something
/// else, pose by pose: then velocities are differences of its poses.
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

/// The motion of a body whose poses come from outside, one by one. Poses may come from any thread.
class PoseTrack {
 public:
  /// @param topic for messages; a pose counts until `timeout_s` of the host's time have passed since it came
  PoseTrack(std::string topic, double timeout_s);

  /// A pose that comes at `now_ns` of the host's time, with the sender's own stamp [s]. False where it is
  /// none (see proper_pose()); it is dropped.
  bool add(const RigidPose& pose, double stamp_s, std::int64_t now_ns);
  /// Velocities are differences of the last two poses, by the sender's stamps where they go on, else by the
  /// host's time. Empty, with `reason`, where no pose has come or the last is too old. Time that went back
  /// forgets what came in that other time.
  [[nodiscard]] std::optional<TruePose> at(std::int64_t now_ns, std::string& reason);
  void reset();

 private:
  struct Sample {
    std::int64_t arrival_ns = 0;
    double stamp_s = 0;
    TruePose motion;
  };
  [[nodiscard]] Sample after_last(const RigidPose& pose, double stamp_s, std::int64_t arrival_ns) const;

  const std::string topic_;
  const std::int64_t timeout_ns_;  // whole, so that an age of exactly the time-out is not too old
  std::mutex mutex_;
  std::optional<Sample> last_;
};

}  // namespace canyon::adapters
