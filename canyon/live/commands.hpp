#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/live/session.hpp"
#include "canyon/transport/link.hpp"

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
  Commands(CommandContext context, std::shared_ptr<transport::Link> link);
  ~Commands();
  Commands(const Commands&) = delete;
  Commands& operator=(const Commands&) = delete;

  /// Answers a line; never throws.
  [[nodiscard]] std::string answer(std::string_view line);
  /// The latest epoch of a receiver, for status requests.
  void keep(const simulation::Epoch& epoch);
  /// Somebody asked for the end of the run.
  [[nodiscard]] bool stopped() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::live
