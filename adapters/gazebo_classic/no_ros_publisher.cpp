// Declared in adapters/gazebo_classic/publishers.hpp.
#include "adapters/gazebo_classic/publishers.hpp"

// Compiled without ROS 1.
#include <utility>

#ifndef CANYON_WITH_ROS
#ifdef CANYON_WITH_ROS2
#include "adapters/ros2/host_publisher.hpp"
#endif

namespace canyon::adapters::gazebo_classic {

std::unique_ptr<live::EpochPublisher> make_ros_publisher([[maybe_unused]] const ReceiverIdentity& identity,
                                                         [[maybe_unused]] const HostSettings& settings,
                                                         [[maybe_unused]] live::FaultAnswerer faults) {
#ifdef CANYON_WITH_ROS2
  return ros2::make_host_publisher(identity, settings, std::move(faults));
#else
  return nullptr;
#endif
}

}  // namespace canyon::adapters::gazebo_classic

#endif
