#include "adapters/gazebo_classic/ros_pose.hpp"

#include <ros/callback_queue.h>
#include <ros/names.h>
#include <ros/spinner.h>
#include <ros/subscriber.h>

#include <gazebo/common/Console.hh>
#include <mutex>
#include <optional>
#include <utility>

#include "adapters/gazebo_classic/ros_link.hpp"
#include "adapters/ros/ros1_types.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

namespace ros1 = ros_messages::ros1;
using PoseCallback = std::function<void(const simulation::RigidPose&, double)>;

class PoseSubscription final : public RosClient {
 public:
  PoseSubscription(std::string topic, PoseCallback callback)
      : topic_(std::move(topic)), callback_(std::move(callback)) {}

  bool connect(ros::NodeHandle& node) override {
    // Its own queue and thread: needs no other spinner, and other callbacks cause no delay.
    ros::NodeHandle own(node);
    own.setCallbackQueue(&queue_);
    subscriber_ = own.subscribe<ros1::PoseStamped>(
        topic_, kQueue, [this](const boost::shared_ptr<const ros1::PoseStamped>& pose) { received(*pose); },
        ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
    if (!subscriber_) return false;
    if (!spinner_) spinner_.emplace(1, &queue_);
    spinner_->start();
    return true;
  }
  void disconnect() override {
    if (spinner_) spinner_->stop();
    spinner_.reset();
    subscriber_.shutdown();
    queue_.clear();
  }

  /// After it returns, no call is running or follows.
  void silence() {
    const std::lock_guard lock(mutex_);
    callback_ = nullptr;
  }

 private:
  static constexpr std::uint32_t kQueue = 100;  // a second of a motion capture system

  void received(const ros1::PoseStamped& message) {
    const auto& p = message.pose.position;
    const auto& q = message.pose.orientation;
    const std::lock_guard lock(mutex_);
    if (!callback_) return;
    callback_({{p.x, p.y, p.z}, {q.w, q.x, q.y, q.z}}, message.header.stamp.toSec());
  }

  const std::string topic_;
  ros::CallbackQueue queue_;
  ros::Subscriber subscriber_;
  std::optional<ros::AsyncSpinner> spinner_;
  std::mutex mutex_;
  PoseCallback callback_;
};

}  // namespace

std::shared_ptr<void> subscribe_ros_pose(
    const std::string& topic, std::function<void(const simulation::RigidPose&, double stamp_s)> callback) {
  try {
    // "~/..." means "in this world" in Gazebo; in ROS it would be the process's own namespace.
    if (!topic.empty() && topic.front() == '~') return nullptr;
    std::string problem;
    if (topic.empty() || !ros::names::validate(topic, problem)) {
      gzerr << "[canyon] <pose_topic>: '" << topic
            << "' is not a ROS topic name: no poses are received from ROS" << std::endl;
      return nullptr;
    }
    struct Handle {
      std::shared_ptr<RosLink> link;
      std::shared_ptr<PoseSubscription> subscription;
      Handle(std::shared_ptr<RosLink> l, std::shared_ptr<PoseSubscription> s)
          : link(std::move(l)), subscription(std::move(s)) {}
      Handle(const Handle&) = delete;
      Handle& operator=(const Handle&) = delete;
      ~Handle() {
        subscription->silence();
        link->remove(subscription);
      }
    };
    const auto link = RosLink::get();
    const auto subscription = std::make_shared<PoseSubscription>(topic, std::move(callback));
    link->add(subscription);
    return std::make_shared<Handle>(link, subscription);
  } catch (const std::exception& e) {
    gzerr << "[canyon] <pose_topic>: no poses are received from ROS: " << e.what() << std::endl;
    return nullptr;
  }
}

}  // namespace canyon::adapters::gazebo_classic
