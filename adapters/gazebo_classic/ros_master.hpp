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

enum class MasterAnswer : std::uint8_t {
  None,     ///< nothing, or nothing of a master, within the time
  Unknown,  ///< a master that does not know the node
  Known,    ///< a master that knows it
};

/// Asks a master for a node (XML-RPC lookupNode), without roscpp, whose own question waits for as long as the
/// network stack does. Takes at most `timeout`. Ends early, with None, when something can be read from
/// `stop_fd` (negative: none). No exceptions.
[[nodiscard]] MasterAnswer ask_master(const MasterAddress& master, const std::string& node,
                                      std::chrono::milliseconds timeout, int stop_fd = -1) noexcept;

}  // namespace canyon::adapters::gazebo_classic
