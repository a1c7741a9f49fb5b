#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "canyon/simulation/live_receiver.hpp"

// Options and faults of receivers, read and set while a host runs. Requests come from any thread; the host's
// own thread answers them between two steps.

namespace canyon::adapters {

struct OptionsRequest {
  enum class Kind { Get, Set, Faults, AddFault, EndFault };

  Kind kind = Kind::Get;
  std::string receiver;  ///< its name; empty: all receivers
  /// Get: a key or a section, empty for all. Set: YAML or JSON of simulation::changed_live_config().
  /// AddFault: an item of a scenario's `faults`, YAML or JSON. EndFault: a fault's name.
  std::string text = {};
};

/// A receiver that runs, as requests see it.
struct AdjustableReceiver {
  std::string name;
  simulation::LiveReceiver* receiver = nullptr;
  /// Called after a change: the host's copies of receiver->config(), its rate and lever arm, may be out of
  /// date.
  std::function<void()> changed = {};
};

/// The answer, for people and programs: several lines without one at the end.
///  - Get, of one receiver: "key: value" a line, which Set takes; of all: sections of such lines by receiver.
///  - Set: "set NAME: key: old -> new" for each change, or "unchanged: ..."; all receivers that are asked for
///  take their change, and begin anew (but for rate_hz alone), or none does.
///  - Faults: "NAME: FAULT (KIND) from 3 s until 23 s, at work" a line; "none".
///  - AddFault, EndFault: "added NAME: FAULT", "ended NAME: FAULT" for each receiver; they go on.
///  - "refused: why; cure", and nothing has changed.
/// Never throws InputError.
[[nodiscard]] std::string answer(const OptionsRequest& request,
                                 const std::vector<AdjustableReceiver>& receivers);

/// A queue in which requests wait for the host's thread.
class OptionsDesk {
 public:
  /// Any thread but the host's. Waits for the answer; "refused: ..." where nobody serves within `patience`.
  [[nodiscard]] std::string ask(OptionsRequest request, std::chrono::milliseconds patience);
  /// Answers waiting requests. For the host's thread, at every update, paused or not. `receivers` is called
  /// only if there are requests.
  void serve(const std::function<std::vector<AdjustableReceiver>()>& receivers);
  /// Nobody serves any longer: all who wait, and who come, are refused.
  void close();

 private:
  struct Waiting {
    OptionsRequest request;
    std::string answer;
    bool done = false;
  };
  std::mutex mutex_;
  std::condition_variable answered_;
  std::deque<std::shared_ptr<Waiting>> waiting_;
  std::atomic<bool> somebody_{false};
  bool closed_ = false;
};

}  // namespace canyon::adapters
