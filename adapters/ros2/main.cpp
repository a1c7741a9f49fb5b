// No header declares it: the program begins here. One receiver as a process: `ros2 run canyon_ros2 receiver`.
#include <memory>
#include <rclcpp/rclcpp.hpp>

#include "adapters/ros2/receiver_node.hpp"

int main(int argc, char** argv) {
  rclcpp::init(argc, argv);
  bool failed = false;
  {
    const auto node = std::make_shared<canyon::adapters::ros2::ReceiverNode>(rclcpp::NodeOptions());
    rclcpp::executors::SingleThreadedExecutor executor;
    executor.add_node(node->get_node_base_interface());
    executor.spin();
    failed = node->failed();
  }
  rclcpp::shutdown();
  return failed ? 1 : 0;
}
