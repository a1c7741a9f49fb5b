#pragma once

#include <memory>
#include <rclcpp_lifecycle/lifecycle_node.hpp>

namespace canyon::adapters::ros2 {

/// One receiver as a managed node, loaded by itself or into a container
/// (canyon::adapters::ros2::ReceiverNode). configure reads the parameters and loads the city, activate begins
/// the drive, or listens to poses. Its parameters are parameter_keys(), its topics stand in docs/ros2.md.
/// It deactivates itself when the drive has ended.
class ReceiverNode final : public rclcpp_lifecycle::LifecycleNode {
 public:
  explicit ReceiverNode(const rclcpp::NodeOptions& options);
  ~ReceiverNode() override;

  using CallbackReturn = rclcpp_lifecycle::node_interfaces::LifecycleNodeInterface::CallbackReturn;
  CallbackReturn on_configure(const rclcpp_lifecycle::State& state) override;
  CallbackReturn on_activate(const rclcpp_lifecycle::State& state) override;
  CallbackReturn on_deactivate(const rclcpp_lifecycle::State& state) override;
  CallbackReturn on_cleanup(const rclcpp_lifecycle::State& state) override;
  CallbackReturn on_shutdown(const rclcpp_lifecycle::State& state) override;
  CallbackReturn on_error(const rclcpp_lifecycle::State& state) override;

  /// `autostart` was asked for and did not work out.
  [[nodiscard]] bool failed() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::adapters::ros2
