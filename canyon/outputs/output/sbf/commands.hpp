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

namespace canyon::output::sbf {

/// The command line of one connection of a Septentrio receiver (PolaRx5TR Reference Guide, chapter 3), as
/// drivers use it: which blocks come how often, the line's speed, restarts. Other commands of the guide are
/// acknowledged and have no effect, since the scenario defines the receiver; unknown ones are refused.
class SbfCommands {
 public:
  static constexpr std::int64_t kQuiet_ms = 1500;
  static constexpr std::size_t kMostLine = 1024;  ///< longer lines are left out

  /// Commands in bytes cut anywhere, and other bytes (RTCM 3), which are passed over. Returns the answers.
  /// @param now_ms GPS time of the last epoch
  [[nodiscard]] std::string receive(std::string_view bytes, std::int64_t now_ms);
  /// The name of the first command, which made it choose what comes; empty: there was none.
  [[nodiscard]] const std::string& first() const { return first_; }

  /// Whether the block is due at an epoch. From the start all are at each epoch. From the first command on
  /// only those are that setSBFOutput names, at its interval, and none within kQuiet_ms after an answer:
  /// drivers (PX4's) look for answers in what they read next, and blocks hide them.
  /// @param epoch_ms milliseconds of GPS time
  [[nodiscard]] bool is_due(std::uint16_t block, std::int64_t epoch_ms);
  /// Whether a block that comes with an event is sent at all.
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
  /// The shortest interval of the streams that have the block; empty: none has it.
  [[nodiscard]] std::optional<std::int64_t> interval_ms(std::uint16_t block) const;
  std::string execute(std::string_view line, std::int64_t now_ms);
  std::string sbf_output(const std::vector<std::string>& words);
  std::string com_settings(const std::vector<std::string>& words);
  std::string reset_receiver(const std::vector<std::string>& words);

  std::string line_, first_;
  std::map<std::string, Stream> streams_;
  std::map<std::uint16_t, std::int64_t> last_turn_;
  std::int64_t quiet_until_ms_ = 0;  ///< GPS time until which none is sent
  std::optional<int> baud_;
  std::optional<disturbance::RestartKind> restart_;
};

}  // namespace canyon::output::sbf
