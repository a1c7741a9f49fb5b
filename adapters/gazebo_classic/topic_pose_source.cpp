// Declared in adapters/gazebo_classic/pose_source.hpp.
#include <atomic>
#include <cstdint>
#include <gazebo/common/Console.hh>
#include <gazebo/common/Events.hh>
#include <gazebo/msgs/msgs.hh>
#include <gazebo/transport/Node.hh>
#include <gazebo/transport/Subscriber.hh>

#include "adapters/gazebo_classic/ignition_types.hpp"
#include "adapters/gazebo_classic/pose_source.hpp"
#ifdef CANYON_WITH_ROS
#include "adapters/gazebo_classic/ros_pose.hpp"
#endif

namespace canyon::adapters::gazebo_classic {
namespace {

using gazebo::common::Time;

// Messages come in threads of Gazebo transport and ROS.
class TopicPoseSource final : public PoseSource {
 public:
  TopicPoseSource(const gazebo::transport::NodePtr& node, const HostSettings& settings)
      : topic_(settings.pose_topic), track_(settings.pose_topic, {settings.pose_timeout_s}) {
    // Age counts in simulated time, which messages of another program's clock do not carry. The event may be
    // in progress in the world's thread while this object ends in another, so it holds what it touches.
    connection_ = gazebo::event::Events::ConnectWorldUpdateBegin(
        [clock = clock_](const gazebo::common::UpdateInfo& info) { *clock = nanoseconds(info.simTime); });
    subscriber_ = node->Subscribe(topic_, &TopicPoseSource::on_gazebo_pose, this);
#ifdef CANYON_WITH_ROS
    ros_subscriber_ =
        subscribe_ros_pose(topic_, [this](const RigidPose& pose, double stamp_s) { on_pose(pose, stamp_s); });
#endif
  }

  ~TopicPoseSource() override {
    // Each waits for its call in progress, before anything else of this object goes.
    ros_subscriber_.reset();
    subscriber_.reset();
  }
  TopicPoseSource(const TopicPoseSource&) = delete;
  TopicPoseSource& operator=(const TopicPoseSource&) = delete;

  std::optional<TruePose> at(const Time& now, std::string& reason) override {
    *clock_ = nanoseconds(now);
    return track_.at(nanoseconds(now), reason);
  }

  void reset() override {
    track_.reset();
    // Poses that come before the world goes on belong to the new time.
    *clock_ = 0;
  }

 private:
  void on_gazebo_pose(ConstPoseStampedPtr& message) {
    if (!message) return;  // another type on the same topic, sent from this process
    on_pose(rigid_pose(gazebo::msgs::ConvertIgn(message->pose())),
            gazebo::msgs::Convert(message->time()).Double());
  }

  void on_pose(const RigidPose& pose, double stamp_s) {
    if (track_.add({pose, stamp_s, {}, {}}, *clock_) != PoseTrack::Taken::NoPose ||
        complained_.exchange(true)) {
      return;
    }
    gzerr << "Poses on " << topic_
          << " are dropped where they are not finite or their quaternion is zero; this is the first.\n";
  }

  const std::string topic_;
  const std::shared_ptr<std::atomic<std::int64_t>> clock_ = std::make_shared<std::atomic<std::int64_t>>(0);
  PoseTrack track_;
  std::atomic<bool> complained_{false};
  gazebo::event::ConnectionPtr connection_;
  gazebo::transport::SubscriberPtr subscriber_;
  std::shared_ptr<void> ros_subscriber_;  // null without ROS
};

}  // namespace

std::unique_ptr<PoseSource> make_topic_pose_source(const gazebo::transport::NodePtr& node,
                                                   const HostSettings& settings) {
  return std::make_unique<TopicPoseSource>(node, settings);
}

}  // namespace canyon::adapters::gazebo_classic
