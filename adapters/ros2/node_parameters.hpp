#pragma once

#include <functional>
#include <rclcpp_lifecycle/lifecycle_node.hpp>

#include "adapters/ros2/node_settings.hpp"

namespace canyon::adapters::ros2 {

/// A node's parameters: NodeSettings declared with descriptors and ranges, and their given values.
class NodeParameters {
 public:
  struct Owner {
    std::function<bool()> configured;  ///< only the receiver's parameters may change
    /// Applies given, valid settings. Throws InputError if they cannot be applied.
    std::function<void(const NodeSettings&)> change;
  };

  /// Declares all parameters. An unknown parameter of the command line or a file is a warning, an invalid
  /// value an error in the log; settings() throws it again.
  NodeParameters(rclcpp_lifecycle::LifecycleNode& node, Owner owner);

  /// The present settings. Throws InputError.
  [[nodiscard]] NodeSettings settings() const { return read_settings(given_); }
  /// Whether the node shall configure and activate itself, if this parameter can be read.
  [[nodiscard]] bool autostart() const;
  /// Sets all parameters that are not given to `settings`.
  void show(const NodeSettings& settings);

 private:
  void declare();
  rcl_interfaces::msg::SetParametersResult check(const std::vector<rclcpp::Parameter>& changes);

  rclcpp_lifecycle::LifecycleNode& node_;
  Owner owner_;
  Parameters given_;
  bool showing_ = false;
  rclcpp::node_interfaces::PreSetParametersCallbackHandle::SharedPtr before_;
  rclcpp::node_interfaces::OnSetParametersCallbackHandle::SharedPtr check_;
};

}  // namespace canyon::adapters::ros2
