#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/paths/disturbance/faults/receiver_faults.hpp"

namespace canyon::encoding::sbf {

/// The command line of one connection of a Septentrio receiver (PolaRx5TR Reference Guide, chapter 3), as
/// used by drivers: selection and rate of blocks, the line's speed, restarts. Other commands of the guide are
/// acknowledged without effect, since the scenario defines the receiver; unknown commands are rejected.
class SbfCommands {
 public:
  static constexpr std::int64_t kQuiet_ms = 1500;
  static constexpr std::size_t kMaxLine = 1024;  ///< longer lines are ignored

  /// Takes bytes cut anywhere: commands, and other bytes (RTCM 3), which are ignored. Returns the responses.
  /// @param now_ms GPS time of the last epoch
  [[nodiscard]] std::string receive(std::string_view bytes, std::int64_t now_ms);
  /// The name of the first command, from which on commands select the blocks; empty: none so far.
  [[nodiscard]] const std::string& first() const { return first_; }

  /// Whether the block is due at an epoch. Initially all blocks are due at each epoch. From the first command
  /// on, only blocks selected by setSBFOutput are due, at its interval, and none within kQuiet_ms after a
  /// response: drivers (PX4's) expect a response in the next bytes that they read, and blocks would hide it.
  /// @param epoch_ms milliseconds of GPS time
  [[nodiscard]] bool is_due(std::uint16_t block, std::int64_t epoch_ms);
  /// Whether a block that is triggered by an event is enabled.
  [[nodiscard]] bool sends(std::uint16_t block) const {
    return first_.empty() || interval_ms(block).has_value();
  }
  [[nodiscard]] std::optional<int> take_baud() { return std::exchange(baud_, std::nullopt); }
  [[nodiscard]] std::optional<disturbance::RestartKind> take_restart() {
    return std::exchange(restart_, std::nullopt);
  }

 private:
  struct Stream {
    std::set<std::uint16_t> blocks;
    std::int64_t interval_ms = 0;  ///< 0: at each epoch
    bool on = true;
  };
  /// The shortest interval of the streams with this block; empty: no stream has it.
  [[nodiscard]] std::optional<std::int64_t> interval_ms(std::uint16_t block) const;
  std::string execute(std::string_view line, std::int64_t now_ms);
  std::string sbf_output(const std::vector<std::string>& words);
  std::string com_settings(const std::vector<std::string>& words);
  std::string reset_receiver(const std::vector<std::string>& words);

  std::string line_, first_;
  std::map<std::string, Stream> streams_;
  std::map<std::uint16_t, std::int64_t> previous_rotation_;
  std::int64_t quiet_until_ms_ = 0;  ///< GPS time until which no block is sent
  std::optional<int> baud_;
  std::optional<disturbance::RestartKind> restart_;
};

}  // namespace canyon::encoding::sbf
