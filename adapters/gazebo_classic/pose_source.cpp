#include "adapters/gazebo_classic/pose_source.hpp"

#include <fmt/format.h>

#include <boost/weak_ptr.hpp>
#include <gazebo/common/Console.hh>
#include <gazebo/common/Events.hh>
#include <gazebo/msgs/msgs.hh>
#include <gazebo/physics/Link.hh>
#include <gazebo/transport/Node.hh>
#include <gazebo/transport/Subscriber.hh>

#include "adapters/gazebo_classic/ignition_types.hpp"
#ifdef CANYON_WITH_ROS
#include "adapters/gazebo_classic/ros_pose.hpp"
#endif

namespace canyon::adapters::gazebo_classic {
namespace {

using ignition::math::Pose3d;

class LinkPoseSource final : public PoseSource {
 public:
  LinkPoseSource(const gazebo::physics::LinkPtr& link, const Pose3d& sensor_on_link)
      : link_(link), name_(link->GetScopedName()), sensor_on_link_(sensor_on_link) {}

  std::optional<simulation::RigidPose> at(const gazebo::common::Time& now, std::string& reason) override {
    const gazebo::physics::LinkPtr link = link_.lock();
    if (!link) {
      reason = fmt::format("link {} no longer exists", name_);
      return std::nullopt;
    }
    // The engine's velocity at the sensor's point; the offset is in the link's frame.
    simulation::RigidPose engine = rigid_pose(sensor_on_link_ + link->WorldPose());
    engine.linear_velocity = eigen(link->WorldLinearVel(sensor_on_link_.Pos()));
    engine.angular_velocity = eigen(link->WorldAngularVel());
    const auto motion = motion_.at(nanoseconds(now), engine);
    if (!motion) reason = fmt::format("the physics engine has no finite pose of link {}", name_);
    return motion;
  }

  void reset() override { motion_.reset(); }

 private:
  boost::weak_ptr<gazebo::physics::Link> link_;  // a link owns its plugins, not vice versa
  std::string name_;
  Pose3d sensor_on_link_;
  simulation::EngineMotion motion_;
};

// Messages arrive in threads of Gazebo transport and ROS.
class TopicPoseSource final : public PoseSource {
 public:
  TopicPoseSource(const gazebo::transport::NodePtr& node, const HostSettings& settings)
      : poses_(std::make_shared<simulation::PoseInbox>(settings.pose_topic, settings.pose_timeout_s)) {
    // The event may be running in the world's thread while this object ends in another: it owns its data.
    connection_ = gazebo::event::Events::ConnectWorldUpdateBegin(
        [poses = poses_](const gazebo::common::UpdateInfo& info) { poses->step(nanoseconds(info.simTime)); });
    subscriber_ = node->Subscribe(settings.pose_topic, &TopicPoseSource::on_gazebo_pose, this);
#ifdef CANYON_WITH_ROS
    ros_subscriber_ = subscribe_ros_pose(
        settings.pose_topic,
        [this](const simulation::RigidPose& pose, double stamp_s) { on_pose(pose, stamp_s); });
#endif
  }

  ~TopicPoseSource() override {
    // Each waits for its call in progress before other members are destroyed.
    ros_subscriber_.reset();
    subscriber_.reset();
  }
  TopicPoseSource(const TopicPoseSource&) = delete;
  TopicPoseSource& operator=(const TopicPoseSource&) = delete;

  std::optional<simulation::RigidPose> at(const gazebo::common::Time& now, std::string& reason) override {
    return poses_->at(nanoseconds(now), reason);
  }
  void reset() override {
    poses_->reset();
  }

 private:
  void on_gazebo_pose(ConstPoseStampedPtr& message) {
    if (!message) return;  // another type on the same topic, sent from this process
    on_pose(rigid_pose(gazebo::msgs::ConvertIgn(message->pose())),
            gazebo::msgs::Convert(message->time()).Double());
  }

  void on_pose(const simulation::RigidPose& pose, double stamp_s) {
    const std::string logged = poses_->take(pose, stamp_s);
    if (!logged.empty()) gzerr << "[canyon] " << logged << "\n";
  }

  const std::shared_ptr<simulation::PoseInbox> poses_;
  gazebo::event::ConnectionPtr connection_;
  gazebo::transport::SubscriberPtr subscriber_;
  std::shared_ptr<void> ros_subscriber_;  // null without ROS
};

}  // namespace

std::unique_ptr<PoseSource> make_link_pose_source(const gazebo::physics::LinkPtr& link,
                                                  const Pose3d& sensor_on_link) {
  return std::make_unique<LinkPoseSource>(link, sensor_on_link);
}

std::unique_ptr<PoseSource> make_topic_pose_source(const gazebo::transport::NodePtr& node,
                                                   const HostSettings& settings) {
  return std::make_unique<TopicPoseSource>(node, settings);
}

}  // namespace canyon::adapters::gazebo_classic
