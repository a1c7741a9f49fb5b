#include "canyon/calibration/open_facades.hpp"

#include <fmt/format.h>

#include <array>

#include "canyon/base/text.hpp"
#include "canyon/unknowns/unknowns.hpp"

namespace canyon::calibration {
namespace {

/// Shares of buildings with coated glass that a receiver is simulated with.
constexpr std::array kCoatedShares = {0.0, 0.35, 0.7};

}  // namespace

simulation::Scenario with_coated_glass(simulation::Scenario scenario, double share) {
  scenario.city.facades.shares = unknowns::facades_with(share);
  return scenario;
}

std::vector<Facades> open_facades(
    const simulation::Scenario& scenario,
    const std::function<std::unique_ptr<simulation::Environment>(const simulation::Scenario&)>& draw) {
  std::vector<Facades> facades;
  if (!unknowns::leaves_facades_open(scenario)) return facades;
  for (const double share : kCoatedShares)
    facades.push_back({share, [=] { return draw(with_coated_glass(scenario, share)); }});
  return facades;
}

std::optional<double> fitted_glass(const Calibration& result) {
  if (!result.coated_glass || result.coated_glass->verdict != Estimate::Verdict::Fitted) return {};
  return parse_double(result.coated_glass->after);
}

std::vector<std::string> facade_shares(double coated_glass) {
  std::vector<std::string> items;
  for (const auto& [facade, share] : unknowns::facades_with(coated_glass))
    items.push_back(fmt::format("{}={:.0f}", facade, 100 * share));
  return items;
}

}  // namespace canyon::calibration
