#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "adapters/ros2/node_settings.hpp"
#include "adapters/ros2/topic_names.hpp"

namespace canyon::adapters::ros2 {

/// The part of a receiver's driver that the node plays: its program, names and parameters.
struct DriverRole {
  Driver driver = Driver::None;
  std::string_view name;             ///< of its package
  std::string_view program;          ///< that a launch file starts
  std::string_view node;             ///< default name of its node
  std::string_view frame_id;         ///< of its messages, by default
  std::string_view rtcm;             ///< topic of corrections that it takes; empty: none
  bool diagonal_covariance = false;  ///< of its fixes
  TopicNames topics;
};

/// All that there are; the first is Driver::None, the receiver's own node.
[[nodiscard]] const std::vector<DriverRole>& driver_roles();
[[nodiscard]] const DriverRole& role_of(Driver driver);
/// The one whose program has this path or name; others are the receiver's own node.
[[nodiscard]] const DriverRole& role_of_program(std::string_view path);

/// Topics of a node with these settings: the driver's, sensors that the scenario's own drive has, the clock.
[[nodiscard]] TopicNames topics_of(const NodeSettings& settings);

/// Parameters for the node out of those for the driver: `rate` of ublox_gps is `rate_hz`, and so on. The
/// node's own stay, and go before the driver's. Names that mean nothing here come back in `unused`.
/// @param given["driver"] says which driver, if any
[[nodiscard]] Parameters own_parameters(const Parameters& given, std::vector<std::string>& unused);

}  // namespace canyon::adapters::ros2
