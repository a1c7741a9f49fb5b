#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/transport/link.hpp"
#include "canyon/outputs/live/session.hpp"
#include "canyon/run/live_receiver.hpp"

// Options and faults of receivers, read and set while they run: by services of hosts, whose requests come
// from any thread and are answered by the host's own between two steps, and by the commands of a session.

namespace canyon::live {

struct OptionsRequest {
  enum class Kind { Get, Set, Faults, AddFault, EndFault };

  Kind kind = Kind::Get;
  std::string receiver;  ///< its name; empty: all receivers
  /// Get: a key or a section, empty for all. Set: YAML or JSON of simulation::changed_live_config().
  /// AddFault: an item of a scenario's `faults`, YAML or JSON. EndFault: a fault's name.
  std::string text = {};
  std::filesystem::path source = "request";  ///< for messages and relative paths of `text`
};

/// A receiver that runs, as requests see it.
struct AdjustableReceiver {
  std::string name;
  simulation::LiveReceiver* receiver = nullptr;
  /// Called after a change: the host's copies of receiver->config(), its rate and lever arm, may be out of
  /// date.
  std::function<void()> changed = {};
  simulation::LiveReceiver* base = nullptr;  ///< beside it, to which its faults go as well; null: none
  bool changes_rate = true;                  ///< rate_hz may change while it runs
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
/// The same, but throws InputError instead of "refused: ...".
std::string perform(const OptionsRequest& request, const std::vector<AdjustableReceiver>& receivers);

/// A queue in which requests wait for the host's thread.
class OptionsDesk {
 public:
  /// A transport may have one thread for all that a process receives: a request must not hold it for long.
  static constexpr std::chrono::milliseconds kPatience{1000};

  /// Any thread but the host's. Waits for the answer; "refused: ..." where nobody serves within `patience`.
  [[nodiscard]] std::string ask(OptionsRequest request, std::chrono::milliseconds patience = kPatience);
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

/// A service that a transport offers for each kind of request.
struct ControlService {
  const char* name;  ///< the last part of its name: "add_fault"
  OptionsRequest::Kind kind;
  bool of_faults =
      true;  ///< offered by ROS as well: canyon_msgs/FaultCommand, text in, success and message out
};
inline constexpr ControlService kControlServices[]{{"get_options", OptionsRequest::Kind::Get, false},
                                                   {"set_options", OptionsRequest::Kind::Set, false},
                                                   {"get_faults", OptionsRequest::Kind::Faults},
                                                   {"add_fault", OptionsRequest::Kind::AddFault},
                                                   {"end_fault", OptionsRequest::Kind::EndFault}};

struct ServiceReply {
  bool success = false;
  std::string message;  ///< as answer() says it
};

/// Answers the services of faults of one receiver, in the thread of their caller.
struct FaultAnswerer {
  std::function<std::string(const OptionsRequest&)> answer;
  bool changes = false;       ///< requests may change the simulation
  std::string allow_by = {};  ///< how somebody allows it, "set the parameter live.changes"

  /// Calls `answer` if the request is allowed.
  [[nodiscard]] ServiceReply call(OptionsRequest::Kind kind, const std::string& text) const;
};

/// The state that commands read and change.
struct CommandContext {
  std::filesystem::path source;  ///< of the scenario, as OptionsRequest::source
  std::vector<AdjustableReceiver> receivers;
  const SessionFigures& figures;
  bool changes = false;           ///< may change the simulation
  std::function<double()> now_s;  ///< the scenario's time
};

/// Requests to a running session as JSON: one object a line in, one out, {"ok": true, ...} or {"ok": false,
/// "error": ..., "cure": ...} (docs/live.md lists them).
class Commands {
 public:
  virtual ~Commands() = default;
  /// Answers a line; never throws.
  [[nodiscard]] virtual std::string answer(std::string_view line) = 0;
  /// The latest epoch of a receiver, for status requests.
  virtual void keep(const simulation::Epoch& epoch) = 0;
  /// Somebody asked for the end of the run.
  [[nodiscard]] virtual bool stopped() const = 0;
};
/// Answers the lines that come by a link.
[[nodiscard]] std::unique_ptr<Commands> make_commands(CommandContext context,
                                                      std::shared_ptr<transport::Link> link);

}  // namespace canyon::live
