#pragma once

#include <canyon_msgs/srv/fault_command.hpp>
#include <memory>
#include <rclcpp/create_service.hpp>
#include <vector>

#include "adapters/common/fault_services.hpp"

namespace canyon::adapters::ros2 {

/// The services ~/get_faults, ~/add_fault and ~/end_fault of a node, canyon_msgs/FaultCommand, for as long as
/// it lives. A call that is under way may outlive it.
class FaultServices {
 public:
  /// @param node an rclcpp::Node or a managed one
  template <class Node>
  FaultServices(Node& node, FaultAnswerer faults)
      : FaultServices(node.get_node_base_interface(), node.get_node_services_interface(), std::move(faults)) {
  }

 private:
  FaultServices(rclcpp::node_interfaces::NodeBaseInterface::SharedPtr base,
                rclcpp::node_interfaces::NodeServicesInterface::SharedPtr services, FaultAnswerer faults);

  std::vector<rclcpp::Service<canyon_msgs::srv::FaultCommand>::SharedPtr> services_;
};

}  // namespace canyon::adapters::ros2
