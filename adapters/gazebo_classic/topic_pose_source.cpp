#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <gazebo/common/Console.hh>
#include <gazebo/common/Events.hh>
#include <gazebo/msgs/msgs.hh>
#include <gazebo/transport/Node.hh>
#include <gazebo/transport/Subscriber.hh>
#include <mutex>

#include "adapters/gazebo_classic/pose_motion.hpp"
#include "adapters/gazebo_classic/pose_source.hpp"
#ifdef CANYON_WITH_ROS
#include "adapters/gazebo_classic/ros_pose.hpp"
#endif

namespace canyon::gazebo_classic {
namespace {

using gazebo::common::Time;
using ignition::math::Pose3d;

std::int64_t nanoseconds(const Time& time) {
  return time.sec * std::int64_t{1'000'000'000} + time.nsec;
}
double seconds(std::int64_t ns) {
  return static_cast<double>(ns) * 1e-9;
}

// Messages come in threads of Gazebo transport and ROS; everything about them is behind one mutex.
class TopicPoseSource final : public PoseSource {
 public:
  TopicPoseSource(const gazebo::transport::NodePtr& node, const PluginSettings& settings)
      : topic_(settings.pose_topic), timeout_ns_(std::llround(settings.pose_timeout_s * 1e9)) {
    // Age counts in simulated time, which messages of another program's clock do not carry. The event may be
    // in progress in the world's thread while this object ends in another, so it holds what it touches.
    connection_ = gazebo::event::Events::ConnectWorldUpdateBegin(
        [clock = clock_](const gazebo::common::UpdateInfo& info) { *clock = nanoseconds(info.simTime); });
    subscriber_ = node->Subscribe(topic_, &TopicPoseSource::on_gazebo_pose, this);
#ifdef CANYON_WITH_ROS
    ros_subscriber_ =
        subscribe_ros_pose(topic_, [this](const Pose3d& pose, double stamp_s) { on_pose(pose, stamp_s); });
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
    const std::lock_guard<std::mutex> lock(mutex_);
    *clock_ = nanoseconds(now);
    // Time jumped back, reset or not: what came in that other time says nothing about this one.
    if (last_ && last_->arrival_ns > nanoseconds(now)) last_.reset();
    if (!last_) {
      reason = fmt::format("no pose has come on {} yet", topic_);
      return std::nullopt;
    }
    const std::int64_t age_ns = nanoseconds(now) - last_->arrival_ns;
    if (age_ns > timeout_ns_) {
      reason = fmt::format("the last pose on {} is {:.1f} s old", topic_, seconds(age_ns));
      return std::nullopt;
    }
    return last_->motion;
  }

  void reset() override {
    const std::lock_guard<std::mutex> lock(mutex_);
    last_.reset();
    // Poses that come before the world goes on belong to the new time.
    *clock_ = 0;
  }

 private:
  struct Sample {
    std::int64_t arrival_ns = 0;  // of simulated time
    double stamp_s = 0;
    TruePose motion;
  };

  void on_gazebo_pose(ConstPoseStampedPtr& message) {
    if (!message) return;  // another type on the same topic, sent from this process
    on_pose(gazebo::msgs::ConvertIgn(message->pose()), gazebo::msgs::Convert(message->time()).Double());
  }

  void on_pose(const Pose3d& raw, double stamp_s) {
    const std::optional<Pose3d> pose = proper_pose(raw);
    bool complain = false;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (pose) {
        last_ = after(last_, *pose, stamp_s, *clock_);
      } else {
        complain = !complained_;
        complained_ = true;
      }
    }
    if (complain) {
      gzerr << "Poses on " << topic_
            << " are dropped where they are not finite or their quaternion is zero; this is the first.\n";
    }
  }

  // The sample that a pose makes after another one.
  [[nodiscard]] Sample after(const std::optional<Sample>& before, const Pose3d& pose, double stamp_s,
                             std::int64_t arrival_ns) const {
    Sample sample{arrival_ns, stamp_s, {pose, {}, {}}};
    if (!before) return sample;
    const std::int64_t arrival_step_ns = arrival_ns - before->arrival_ns;
    // A difference across a time without truth, or from before a jump back, is no velocity.
    if (arrival_step_ns < 0 || arrival_step_ns > timeout_ns_) return sample;
    // The sender's clock, if it runs; several messages may come within one step of simulated time.
    const double stamp_step_s = stamp_s - before->stamp_s;
    const double step_s = stamp_step_s > 0 ? stamp_step_s : seconds(arrival_step_ns);
    if (step_s > 0) {
      sample.motion = motion_between(before->motion.pose, pose, step_s);
    } else if (pose == before->motion.pose) {
      sample.motion = before->motion;  // the same message again
    }
    return sample;
  }

  const std::string topic_;
  const std::int64_t timeout_ns_;  // whole, so that an age of exactly the time-out is not too old
  const std::shared_ptr<std::atomic<std::int64_t>> clock_ = std::make_shared<std::atomic<std::int64_t>>(0);
  std::mutex mutex_;
  std::optional<Sample> last_;
  bool complained_ = false;
  gazebo::event::ConnectionPtr connection_;
  gazebo::transport::SubscriberPtr subscriber_;
  std::shared_ptr<void> ros_subscriber_;  // null without ROS
};

}  // namespace

std::unique_ptr<PoseSource> make_topic_pose_source(const gazebo::transport::NodePtr& node,
                                                   const PluginSettings& settings) {
  return std::make_unique<TopicPoseSource>(node, settings);
}

}  // namespace canyon::gazebo_classic
