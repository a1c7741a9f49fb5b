#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "adapters/gazebo_classic/ros_link.hpp"

// C++17, as ros_services.cpp.

namespace canyon::adapters::gazebo_classic {

/// A service canyon_msgs/FaultCommand.
struct RosService {
  std::string name;  ///< absolute
  /// Request to success and message; called from a thread of ROS, one call of these at a time.
  std::function<std::pair<bool, std::string>(const std::string&)> call;
};

/// Offers services while it is in a RosLink, with each new master.
[[nodiscard]] std::shared_ptr<RosClient> make_ros_services(std::vector<RosService> services);

}  // namespace canyon::adapters::gazebo_classic
