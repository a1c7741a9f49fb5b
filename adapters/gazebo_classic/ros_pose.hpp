#pragma once

#include <functional>
#include <memory>
#include <string>

#include "canyon/run/motion/pose_motion.hpp"

namespace canyon::adapters::gazebo_classic {

/// Hands on every geometry_msgs/PoseStamped of a ROS topic, as it is: pose [m, unit quaternion] and
/// header.stamp [s]. `callback` is called from a thread of ROS, one call at a time. Never blocks and never
/// throws: without a master, poses come once there is one. Dropping what is returned ends it; when that
/// returns, no call is running and none will come. Only where built with ROS (CANYON_WITH_ROS).
[[nodiscard]] std::shared_ptr<void> subscribe_ros_pose(
    const std::string& topic, std::function<void(const simulation::RigidPose&, double stamp_s)> callback);

}  // namespace canyon::adapters::gazebo_classic
