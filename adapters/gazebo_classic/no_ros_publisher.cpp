#include "adapters/gazebo_classic/publishers.hpp"

#ifndef CANYON_WITH_ROS

namespace canyon::adapters::gazebo_classic {

std::unique_ptr<EpochPublisher> make_ros_publisher(const ReceiverIdentity&, const PluginSettings&) {
  return nullptr;
}

}  // namespace canyon::adapters::gazebo_classic

#endif
