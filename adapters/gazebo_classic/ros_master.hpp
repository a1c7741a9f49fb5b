#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace canyon::adapters::gazebo_classic {

/// The address of a ROS master.
struct MasterAddress {
  std::string host;
  std::uint16_t port = 0;
  [[nodiscard]] std::string uri() const;
};

/// Parses "http://HOST:PORT" with or without '/' at the end, as in ROS_MASTER_URI; empty for anything else.
[[nodiscard]] std::optional<MasterAddress> parse_master_uri(const std::string& uri);

enum class MasterReply : std::uint8_t {
  None,        ///< no response of a master within the time
  Unknown,     ///< a master without the node
  Registered,  ///< a master with the node
};

/// Queries a master for a node (XML-RPC lookupNode), without roscpp, whose query has only the network stack's
/// time-out. Takes at most `timeout`. Returns None early if `stop_fd` becomes readable (negative: none). Does
/// not throw.
[[nodiscard]] MasterReply query_master(const MasterAddress& master, const std::string& node,
                                       std::chrono::milliseconds timeout, int stop_fd = -1) noexcept;

}  // namespace canyon::adapters::gazebo_classic
