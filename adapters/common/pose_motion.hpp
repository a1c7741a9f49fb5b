#pragma once

#include <cstdint>
#include <optional>

#include "canyon/simulation/motion/pose_motion.hpp"

namespace canyon::adapters {

using simulation::motion_between;
using simulation::PoseTrack;
using simulation::proper_pose;
using simulation::RigidPose;
using simulation::same_pose;
using simulation::TruePose;
using simulation::yaw_of;

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

}  // namespace canyon::adapters
