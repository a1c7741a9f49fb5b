#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "adapters/common/ray_visuals.hpp"

namespace canyon::adapters {

/// Remembers the shapes that were sent to clients, and finds the new ones.
class VisualLedger {
 public:
  struct Change {
    std::string name;
    std::uint32_t id = 0;
    bool visible = true;  ///< false: only `name` and `id` count
    bool whole = true;    ///< false: it was sent before with this colour; only place and size are new
    VisualShape shape;
  };

  /// `next_id` gives every shape, when it is first seen, a number unique in its world.
  explicit VisualLedger(std::function<std::uint32_t()> next_id) : next_id_(std::move(next_id)) {}

  /// Replaces the visible shapes. Returns those to send: new, changed or visible again
  /// (`everything`: all of them, whole), and those that are no longer there.
  [[nodiscard]] std::vector<Change> update(const std::vector<VisualShape>& shapes, bool everything);
  /// All shapes ever sent, hidden ones too; from now on nothing was sent.
  [[nodiscard]] std::vector<std::string> clear();

 private:
  struct Entry {
    std::uint32_t id = 0;
    bool visible = false;
    VisualShape shape;
  };
  std::function<std::uint32_t()> next_id_;
  std::map<std::string, Entry> entries_;
};

/// Time of the machine's steady clock.
[[nodiscard]] inline double steady_now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Lets one call through in every interval of a clock that others read.
class RateLimit {
 public:
  explicit RateLimit(double interval_s) : interval_s_(interval_s) {}
  /// `now_s` of any steady clock.
  [[nodiscard]] bool due(double now_s) {
    if (armed_ && now_s - last_s_ < interval_s_) return false;
    armed_ = true;
    last_s_ = now_s;
    return true;
  }
  /// The next call goes through.
  void reset() { armed_ = false; }

 private:
  double interval_s_;
  double last_s_ = 0;
  bool armed_ = false;
};

}  // namespace canyon::adapters
