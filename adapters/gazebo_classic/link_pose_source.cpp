// Declared in adapters/gazebo_classic/pose_source.hpp.
#include <fmt/format.h>

#include <boost/weak_ptr.hpp>
#include <gazebo/physics/Link.hh>

#include "adapters/gazebo_classic/ignition_types.hpp"
#include "adapters/gazebo_classic/pose_source.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using ignition::math::Pose3d;

class LinkPoseSource final : public PoseSource {
 public:
  LinkPoseSource(const gazebo::physics::LinkPtr& link, const Pose3d& sensor_on_link)
      : link_(link), name_(link->GetScopedName()), sensor_on_link_(sensor_on_link) {}

  std::optional<simulation::TruePose> at(const gazebo::common::Time& now, std::string& reason) override {
    const gazebo::physics::LinkPtr link = link_.lock();
    if (!link) {
      reason = fmt::format("link {} is gone", name_);
      return std::nullopt;
    }
    // The engine's velocity of the point where the sensor is; the offset is in the link's frame.
    const auto motion = motion_.at(nanoseconds(now), {rigid_pose(sensor_on_link_ + link->WorldPose()),
                                                      eigen(link->WorldLinearVel(sensor_on_link_.Pos())),
                                                      eigen(link->WorldAngularVel())});
    if (!motion) reason = fmt::format("the physics engine has no finite pose of link {}", name_);
    return motion;
  }

  void reset() override { motion_.reset(); }

 private:
  boost::weak_ptr<gazebo::physics::Link> link_;  // a link holds its plugins, not they it
  std::string name_;
  Pose3d sensor_on_link_;
  simulation::EngineMotion motion_;
};

}  // namespace

std::unique_ptr<PoseSource> make_link_pose_source(const gazebo::physics::LinkPtr& link,
                                                  const Pose3d& sensor_on_link) {
  return std::make_unique<LinkPoseSource>(link, sensor_on_link);
}

}  // namespace canyon::adapters::gazebo_classic
