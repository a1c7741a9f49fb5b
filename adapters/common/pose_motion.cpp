#include "adapters/common/pose_motion.hpp"

namespace canyon::adapters {

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

}  // namespace canyon::adapters
