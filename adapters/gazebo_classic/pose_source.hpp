#pragma once

#include <gazebo/common/Time.hh>
#include <gazebo/physics/PhysicsTypes.hh>
#include <gazebo/transport/TransportTypes.hh>
#include <ignition/math/Pose3.hh>
#include <memory>
#include <optional>
#include <string>

#include "adapters/common/host_settings.hpp"
#include "canyon/simulation/motion/pose_motion.hpp"

namespace canyon::adapters::gazebo_classic {

/// A source of a receiver's truth, in Gazebo's world frame.
class PoseSource {
 public:
  virtual ~PoseSource() = default;
  /// The truth at `now` of simulated time; empty, with `reason`, if there is none.
  [[nodiscard]] virtual std::optional<simulation::RigidPose> at(const gazebo::common::Time& now,
                                                                std::string& reason) = 0;
  virtual void reset() {}
};

/// The truth of a link, with the pose of a sensor on it.
[[nodiscard]] std::unique_ptr<PoseSource> make_link_pose_source(const gazebo::physics::LinkPtr& link,
                                                                const ignition::math::Pose3d& sensor_on_link);
/// From settings.pose_topic, by geometry_msgs/PoseStamped on ROS (in builds with ROS) and by
/// gazebo.msgs.PoseStamped on Gazebo transport; both in Gazebo's world frame. Velocities are differences of
/// the last two messages. A pose expires settings.pose_timeout_s of simulated time after arrival.
[[nodiscard]] std::unique_ptr<PoseSource> make_topic_pose_source(const gazebo::transport::NodePtr& node,
                                                                 const HostSettings& settings);

}  // namespace canyon::adapters::gazebo_classic
