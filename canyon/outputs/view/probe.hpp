#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/json.hpp"
#include "canyon/run/environment.hpp"
#include "canyon/run/run.hpp"
#include "canyon/run/simulator.hpp"

namespace canyon::view {

/// Antennas put anywhere in a scenario's city: what its receivers would see there, traced as the scenario
/// says. Each question is a receiver that has just been switched on, and stands still. Not thread-safe.
class Probe {
 public:
  /// @param scene the scenario's city
  /// Throws InputError as simulation::LiveReceiver does.
  Probe(const simulation::Simulation& simulation, std::shared_ptr<simulation::CityScene> scene,
        std::size_t paths_per_satellite);
  /// From `begin` on. @param scenario whose receivers are those of the page
  /// @param last_s the run's end; else it is without a known one, and three years long
  Probe(const simulation::Scenario& scenario, geodesy::GpsTime begin, double interval_s,
        std::shared_ptr<simulation::CityScene> scene, std::size_t paths_per_satellite, double last_s = 1e8);

  /// Answers a message "probe" with a message "epoch", and whatever is wrong with it with a message "error"
  /// (docs/view-format.md).
  [[nodiscard]] std::string answer(const std::string& message);

 private:
  struct Question {
    std::size_t receiver = 0;
    double time_s = 0;
    Eigen::Vector3d place;
  };
  [[nodiscard]] Question read(const Json& json) const;
  [[nodiscard]] std::string trace(const Question& question, std::optional<std::int64_t> id);

  std::shared_ptr<simulation::CityScene> scene_;
  std::size_t paths_per_satellite_;
  simulation::Run receivers_;  // each asked alone
  double last_s_;
  /// By the city and its origin.
  Eigen::Vector3d low_ = Eigen::Vector3d::Zero(), high_ = Eigen::Vector3d::Zero();
};

/// The answer where nothing can be traced: an "error" that says why.
[[nodiscard]] std::string no_probe(const std::string& message, std::string_view why);

}  // namespace canyon::view
