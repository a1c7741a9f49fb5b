#include <fmt/format.h>

#include <boost/weak_ptr.hpp>
#include <gazebo/physics/Link.hh>

#include "adapters/gazebo_classic/ignition_types.hpp"
#include "adapters/gazebo_classic/pose_source.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using ignition::math::Pose3d;
using ignition::math::Vector3d;

class LinkPoseSource final : public PoseSource {
 public:
  LinkPoseSource(const gazebo::physics::LinkPtr& link, const Pose3d& sensor_on_link)
      : link_(link), name_(link->GetScopedName()), sensor_on_link_(sensor_on_link) {}

  std::optional<TruePose> at(const gazebo::common::Time& now, std::string& reason) override {
    const gazebo::physics::LinkPtr link = link_.lock();
    if (!link) {
      reason = fmt::format("link {} is gone", name_);
      return std::nullopt;
    }
    const std::optional<RigidPose> pose = proper_pose(rigid_pose(sensor_on_link_ + link->WorldPose()));
    // The engine's velocity of the point where the sensor is; the offset is in the link's frame.
    const Vector3d linear = link->WorldLinearVel(sensor_on_link_.Pos());
    const Vector3d angular = link->WorldAngularVel();
    if (!pose || !linear.IsFinite() || !angular.IsFinite()) {
      last_.reset();
      reason = fmt::format("the physics engine has no finite pose of link {}", name_);
      return std::nullopt;
    }
    Sample sample{
        now, {*pose, eigen(linear), eigen(angular)}, linear == Vector3d::Zero && angular == Vector3d::Zero};
    if (last_ && now < last_->time) last_.reset();
    if (last_ && sample.at_rest && last_->at_rest) {
      // At rest for the engine all the while: if it moved nevertheless, something else moves it, pose by
      // pose.
      const double seconds = (now - last_->time).Double();
      if (seconds > 0) {
        sample.motion = motion_between(last_->motion.pose, *pose, seconds);
      } else if (same_pose(*pose, last_->motion.pose)) {
        sample.motion = last_->motion;  // asked twice at one time
      }
    }
    last_ = sample;
    return sample.motion;
  }

  void reset() override { last_.reset(); }

 private:
  struct Sample {
    gazebo::common::Time time;
    TruePose motion;
    bool at_rest = false;  // as the physics engine has it
  };

  boost::weak_ptr<gazebo::physics::Link> link_;  // a link holds its plugins, not they it
  std::string name_;
  Pose3d sensor_on_link_;
  std::optional<Sample> last_;
};

}  // namespace

std::unique_ptr<PoseSource> make_link_pose_source(const gazebo::physics::LinkPtr& link,
                                                  const Pose3d& sensor_on_link) {
  return std::make_unique<LinkPoseSource>(link, sensor_on_link);
}

}  // namespace canyon::adapters::gazebo_classic
