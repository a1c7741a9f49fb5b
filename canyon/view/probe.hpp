#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "canyon/simulation/simulator.hpp"

namespace canyon::view {

/// Antennas put anywhere in a scenario's city: what its receivers would see there, traced as the scenario
/// says. Each question is a receiver that has just been switched on, and stands still. Not thread-safe.
class Probe {
 public:
  /// @param scene the scenario's city
  /// Throws InputError as simulation::LiveReceiver does.
  Probe(const simulation::Simulation& simulation, std::shared_ptr<simulation::CityScene> scene,
        std::size_t paths_per_satellite);
  /// For a run without a known end, from `begin` on. @param scenario whose receivers are those of the page
  Probe(const simulation::Scenario& scenario, geodesy::GpsTime begin, double interval_s,
        std::shared_ptr<simulation::CityScene> scene, std::size_t paths_per_satellite);
  ~Probe();

  /// Answers a message "probe" with a message "epoch", and whatever is wrong with it with a message "error"
  /// (docs/view-format.md).
  [[nodiscard]] std::string answer(const std::string& message);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The answer where nothing can be traced: an "error" that says why.
[[nodiscard]] std::string no_probe(const std::string& message, std::string_view why);

}  // namespace canyon::view
