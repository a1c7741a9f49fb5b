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
#include "canyon/simulation/receiver_runner.hpp"

// Reads and sets options and faults of running receivers: for services of hosts (requests come from any
// thread; the host's thread handles them between two steps) and for commands of a session.

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

/// A running receiver, as used by requests.
struct ReceiverHandle {
  std::string name;
  simulation::ReceiverRunner* receiver = nullptr;
  /// Called after a change: the host updates its copies of receiver->config(), rate and lever arm.
  std::function<void()> changed = {};
  simulation::ReceiverRunner* base = nullptr;  ///< its base, which gets its faults too; null: none
  bool changes_rate = true;                    ///< rate_hz may change while it runs
};

/// The response, readable by people and programs: lines without a newline at the end.
///  - Get of one receiver: lines "key: value", which Set accepts; of all: one section per receiver.
///  - Set: "set NAME: key: old -> new" for each change, or "unchanged: ..."; either all requested receivers
///  are changed and restart (rate_hz alone needs no restart), or none.
///  - Faults: lines "NAME: FAULT (KIND) from 3 s until 23 s, at work"; "none".
///  - AddFault, EndFault: "added NAME: FAULT", "ended NAME: FAULT" for each receiver, without a restart.
///  - "refused: REASON; HINT" if nothing was changed.
/// Never throws InputError.
[[nodiscard]] std::string handle_request(const OptionsRequest& request,
                                         const std::vector<ReceiverHandle>& receivers);
/// As handle_request(), but throws InputError instead of "refused: ...".
std::string perform(const OptionsRequest& request, const std::vector<ReceiverHandle>& receivers);

/// A queue of requests to the host's thread.
class RequestQueue {
 public:
  /// Short, because a transport's only receiving thread may wait meanwhile.
  static constexpr std::chrono::milliseconds kPatience{1000};

  /// For any thread but the host's. Waits for the response; "refused: ..." if not served within `patience`.
  [[nodiscard]] std::string submit(OptionsRequest request, std::chrono::milliseconds patience = kPatience);
  /// Handles queued requests. For the host's thread, at every update, paused or not. `receivers` is called
  /// only if there are requests.
  void serve(const std::function<std::vector<ReceiverHandle>()>& receivers);
  /// Stops serving. Rejects pending and later requests.
  void close();

 private:
  struct Waiting {
    OptionsRequest request;
    std::string response;
    bool done = false;
  };
  std::mutex mutex_;
  std::condition_variable answered_;
  std::deque<std::shared_ptr<Waiting>> waiting_;
  std::atomic<bool> has_requests_{false};
  bool closed_ = false;
};

/// The services of a transport, one for each kind of request.
struct ControlService {
  const char* name;  ///< the last part of its name: "add_fault"
  OptionsRequest::Kind kind;
  bool has_faults = true;  ///< also a ROS service: canyon_msgs/FaultCommand, text in, success and message out
};
inline constexpr ControlService kControlServices[]{{"get_options", OptionsRequest::Kind::Get, false},
                                                   {"set_options", OptionsRequest::Kind::Set, false},
                                                   {"get_faults", OptionsRequest::Kind::Faults},
                                                   {"add_fault", OptionsRequest::Kind::AddFault},
                                                   {"end_fault", OptionsRequest::Kind::EndFault}};

struct ServiceReply {
  bool success = false;
  std::string message;  ///< as handle_request() returns it
};

/// Handles the fault services of one receiver, in the thread of the caller.
struct FaultRequestHandler {
  std::function<std::string(const OptionsRequest&)> handle;
  bool changes = false;       ///< requests may change the simulation
  std::string allow_by = {};  ///< how to allow them, "set the parameter live.changes"

  /// Calls `handle` if the request is allowed.
  [[nodiscard]] ServiceReply call(OptionsRequest::Kind kind, const std::string& text) const;
};

/// The state that commands read and change.
struct CommandContext {
  std::filesystem::path source;  ///< of the scenario, as OptionsRequest::source
  std::vector<ReceiverHandle> receivers;
  const SessionMetrics& metrics;
  bool changes = false;           ///< may change the simulation
  std::function<double()> now_s;  ///< scenario time
};

/// Requests to a running session as JSON: one object per line in, one out, {"ok": true, ...} or {"ok": false,
/// "error": ..., "cure": ...} (docs/live.md lists them).
class Commands {
 public:
  virtual ~Commands() = default;
  /// Returns the response to a line; never throws.
  [[nodiscard]] virtual std::string handle_request(std::string_view line) = 0;
  /// Stores the latest epoch of a receiver, for status requests.
  virtual void keep(const simulation::Epoch& epoch) = 0;
  /// A client requested the end of the run.
  [[nodiscard]] virtual bool stopped() const = 0;
};
/// Responds to the lines received from a link.
[[nodiscard]] std::unique_ptr<Commands> make_commands(CommandContext context,
                                                      std::shared_ptr<transport::Link> link);

}  // namespace canyon::live
