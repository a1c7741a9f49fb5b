#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "canyon/base/json.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/receiver_group.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::view {

/// Computes the reception of a scenario's receivers at any point of its city, with the scenario's
/// propagation. Each request is for a stationary receiver that has just been switched on. Not thread-safe.
class Probe {
 public:
  /// @param scene the scenario's city
  /// Throws InputError as simulation::ReceiverRunner does.
  Probe(const simulation::Simulation& simulation, std::shared_ptr<simulation::CityScene> scene,
        std::size_t paths_per_satellite);
  /// From `begin` on. @param scenario whose receivers are those of the page
  /// @param last_s the run's end; else the run has no known end and is taken as three years long
  Probe(const simulation::Scenario& scenario, geodesy::GpsTime begin, double interval_s,
        std::shared_ptr<simulation::CityScene> scene, std::size_t paths_per_satellite, double last_s = 1e8);

  /// Returns a message "epoch" for a message "probe", else a message "error" (docs/view-format.md).
  [[nodiscard]] std::string handle_request(const std::string& message);

 private:
  struct ProbeRequest {
    std::size_t receiver = 0;
    double time_s = 0;
    Eigen::Vector3d position;
  };
  [[nodiscard]] ProbeRequest read(const Json& json) const;
  [[nodiscard]] std::string trace(const ProbeRequest& question, std::optional<std::int64_t> id);

  std::shared_ptr<simulation::CityScene> scene_;
  std::size_t paths_per_satellite_;
  simulation::ReceiverGroup receivers_;  // each evaluated alone
  double last_s_;
  /// By the city and its origin.
  Eigen::Vector3d low_ = Eigen::Vector3d::Zero(), high_ = Eigen::Vector3d::Zero();
};

/// The response if nothing can be traced: an "error" with the reason.
[[nodiscard]] std::string no_probe(const std::string& message, std::string_view why);

}  // namespace canyon::view
