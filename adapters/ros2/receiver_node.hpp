#pragma once

#include <memory>
#include <rclcpp_lifecycle/lifecycle_node.hpp>

namespace canyon::adapters::ros2 {

/// One receiver as a managed node, run alone or loaded into a container
/// (canyon::adapters::ros2::ReceiverNode). configure reads the parameters and loads the city, activate starts
/// the drive, or subscribes to poses. Its parameters are parameter_keys(); docs/ros2.md lists its topics. It
/// deactivates itself at the end of the drive.
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

  /// Whether `autostart` was set and failed.
  [[nodiscard]] bool failed() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::adapters::ros2
