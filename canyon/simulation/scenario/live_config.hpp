#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/options/describe.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::simulation {

/// A scenario of a host that brings city and motion itself, of one receiver and, behind it, the base in the
/// host's world, if any.
struct LiveConfig : Scenario {
  LiveConfig() { receivers.resize(1); }
  explicit LiveConfig(Scenario scenario) : Scenario(std::move(scenario)) {}

  /// `corrections.from` may name another receiver of the host's world.
  bool bases_elsewhere = false;
  /// The host gives the samples of Scenario::sensors with each step (LiveReceiver::observe()).
  bool with_sensors = false;

  [[nodiscard]] ReceiverConfig& receiver() { return receivers.front(); }
  [[nodiscard]] const ReceiverConfig& receiver() const { return receivers.front(); }
  /// Null: none.
  [[nodiscard]] const ReceiverConfig* base() const { return receivers.size() > 1 ? &receivers[1] : nullptr; }
};
/// The scenario's keys `sky`, `start`, `rate_hz`, `seed` and `geoid_undulation_m`, and beside them those of
/// the receiver without brackets, and `base` with `name`, `profile` and `fixed`.
void visit(options::Visitor& v, LiveConfig& o);
/// A receiver of a scenario as a host drives it, with `start` and `rate_hz` of the host.
[[nodiscard]] LiveConfig live_config(const Scenario& scenario, std::size_t receiver, geodesy::GpsTime start,
                                     double interval_s);

/// Reads YAML with the fields of a LiveConfig and `faults`, whose times count from the host's time 0. `name`
/// stands in messages; Scenario::warnings has what may be a mistake. Relative paths belong to the folder of
/// `name`. Throws InputError as parse_scenario() does.
[[nodiscard]] LiveConfig parse_live_config(const std::string& text, const std::filesystem::path& name);

/// `config` with what a YAML or JSON text changes of it while the receiver runs: any key of
/// parse_live_config() but `sky`, `start`, `name`, `base`, `corrections.from` and `faults`, nested ("clock:
/// {bias_s: 1}") or with dots ("clock.bias_s: 1"). Keys that are absent stay as they are; `profile` sets all
/// those of a receiver but name, own_draws, corrections.from, lever_arm and streets, and what conflicts with
/// it overrides it. `name` of the text as for parse_live_config(); where it is not empty the text is a
/// request of others, and `profile` names one of Canyon's, or a file in the folder of `name`. Throws
/// InputError as parse_live_config().
[[nodiscard]] LiveConfig changed_live_config(const LiveConfig& config, const std::string& text,
                                             const std::filesystem::path& name);
/// The keys that changed_live_config() knows.
[[nodiscard]] const options::Description& running_description();
/// Their values, a line "clock.bias_s: 1" each, which changed_live_config() takes, without passwords. They do
/// not include `profile`.
[[nodiscard]] std::string running_options(const LiveConfig& config);

/// The field `start`: a text, or a week and seconds of it. A time without a zone is a warning.
void visit_start(options::Visitor& v, std::optional<geodesy::GpsTime>& start,
                 std::vector<std::string>* warnings = nullptr);

}  // namespace canyon::simulation
