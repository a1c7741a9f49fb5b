#pragma once

#include <functional>
#include <memory>
#include <string>

#include "canyon/simulation/motion/pose_motion.hpp"

namespace canyon::adapters::gazebo_classic {

/// Passes on every geometry_msgs/PoseStamped of a ROS topic unchanged: pose [m, unit quaternion] and
/// header.stamp [s]. `callback` is called from a thread of ROS, one call at a time. Does not block or throw:
/// poses arrive when there is a master. Destroying the returned object ends it; afterwards no call is running
/// or follows. Only in builds with ROS (CANYON_WITH_ROS).
[[nodiscard]] std::shared_ptr<void> subscribe_ros_pose(
    const std::string& topic, std::function<void(const simulation::RigidPose&, double stamp_s)> callback);

}  // namespace canyon::adapters::gazebo_classic
