#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/calibration/calibrate.hpp"

// Facades that a scenario leaves open, for a calibration.

namespace canyon::calibration {

/// A scenario with the share of buildings with coated glass, [0, 0.7].
[[nodiscard]] simulation::Scenario with_coated_glass(simulation::Scenario scenario, double share);

/// Drive::facades: the cities that `draw` makes of the scenario with none, some and the most coated glass;
/// empty where the scenario states its facades. `draw` is called while calibrate() runs.
[[nodiscard]] std::vector<Facades> open_facades(
    const simulation::Scenario& scenario,
    const std::function<std::unique_ptr<simulation::Environment>(const simulation::Scenario&)>& draw);

/// The share of buildings with coated glass that was fitted; empty where it was not.
[[nodiscard]] std::optional<double> fitted_glass(const Calibration& result);
/// Items of a scenario's `city.facades.shares` with that share of coated glass, in percent:
/// "coated_glass=14".
[[nodiscard]] std::vector<std::string> facade_shares(double coated_glass);

}  // namespace canyon::calibration
