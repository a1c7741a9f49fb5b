#include "adapters/ros2/node_services.hpp"

#include <string>
#include <utility>

namespace canyon::adapters::ros2 {

using canyon_msgs::srv::FaultCommand;

FaultServices::FaultServices(rclcpp::node_interfaces::NodeBaseInterface::SharedPtr base,
                             rclcpp::node_interfaces::NodeServicesInterface::SharedPtr services,
                             FaultAnswerer faults) {
  const auto answerer = std::make_shared<const FaultAnswerer>(std::move(faults));
  for (const FaultService& service : kFaultServices) {
    services_.push_back(rclcpp::create_service<FaultCommand>(
        base, services, std::string("~/") + service.name,
        // NOLINTNEXTLINE(performance-unnecessary-value-param): the arguments that rclcpp knows a callback by
        [answerer, kind = service.kind](FaultCommand::Request::SharedPtr request,
                                        // NOLINTNEXTLINE(performance-unnecessary-value-param)
                                        FaultCommand::Response::SharedPtr response) {
          ServiceReply reply = answerer->call(kind, request->fault);
          response->success = reply.success;
          response->message = std::move(reply.message);
        },
        rclcpp::ServicesQoS(), nullptr));
  }
}

}  // namespace canyon::adapters::ros2
