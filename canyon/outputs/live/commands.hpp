#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/transport/link.hpp"
#include "canyon/outputs/live/session.hpp"
#include "canyon/run/live_receiver.hpp"
#include "canyon/run/scenario/scenario.hpp"

namespace canyon::live {

/// The state that commands read and change.
struct CommandContext {
  const simulation::Scenario& scenario;
  std::vector<simulation::LiveReceiver>& receivers;
  const Figures& figures;
  bool changes = false;           ///< may change the simulation
  std::function<double()> now_s;  ///< the scenario's time
};

/// Commands to a running session: one JSON object a line in, one out, {"ok": true, ...} or {"ok": false,
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
