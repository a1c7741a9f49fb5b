#include "canyon/heatmap/cells/cell_method.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/text.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/heatmap/cells/steady_receivers.hpp"
#include "canyon/options/read.hpp"
#include "canyon/simulation/profile.hpp"
#include "tests/support/option_values.hpp"
#include "tests/support/tile_scene.hpp"

namespace canyon::heatmap {
namespace {

using gnss::System;
using receiver::ReceiverOptions;
using test::Maps;

const std::vector<Layer> kLayers{Layer::HorizontalError,     Layer::VerticalError,     Layer::Pdop,
                                 Layer::SatellitesUsed,      Layer::SatellitesVisible, Layer::Availability,
                                 Layer::HorizontalErrorMean, Layer::VerticalErrorMean, Layer::NlosShare,
                                 Layer::ProtectionLevel};

ReceiverOptions with(const ReceiverOptions& options, const options::Key& key) {
  ReceiverOptions changed = options;
  options::Document document;
  document.known = options::describe(options).paths();
  std::string value = test::another_value(key);
  if (key.path == "elevation_mask_deg") value = "40";
  if (key.path == "signal.lock.acquisition_threshold_dbhz") value = "36";
  if (key.path == "noise.mu_m") value = "1000";  // the clock takes it, but for the rounding of larger values
  options::read(options::parse_yaml(test::nested(key.path, value), document, ""), document, changed);
  return changed;
}

bool same(const Maps& a, const Maps& b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::memcmp(a[i].data(), b[i].data(), a[i].size() * sizeof(float)) != 0) return false;
  }
  return true;
}

bool is_listed(std::string_view path, std::string_view list) {
  for (const std::string_view name : split_blanks(list)) {
    if (name.back() == '.' ? path.starts_with(name) : path == name) return true;
  }
  return false;
}

/// Changes each field in turn. Those that `fits` accepts must change the map, but the listed ones.
/// @param solve the map of options that fit
template <typename Fits, typename Solve>
void change_each(const ReceiverOptions& base, const Fits& fits, const Solve& solve,
                 std::string_view without_effect) {
  ASSERT_TRUE(fits(base));
  const Maps before = solve(base);
  int refused = 0, moved = 0, unmoved = 0;
  for (const options::Key& key : options::describe(base).keys) {
    const ReceiverOptions changed = with(base, key);
    if (!fits(changed)) {
      ++refused;
      continue;
    }
    const bool moves = !same(solve(changed), before);
    ++(moves ? moved : unmoved);
    EXPECT_NE(moves, is_listed(key.path, without_effect)) << key.path << (moves ? " moves" : " is ignored");
  }
  std::cout << moved << " fields change the map, " << unmoved << " do not, " << refused << " are refused\n";
  EXPECT_GT(refused, 5);
}

// A new option of receivers: say in cell_method.cpp what a map's cells make of it.
TEST(CellMethod, KnowsEveryFieldOfReceivers) {
  for (const CellMethod method : {CellMethod::Shared, CellMethod::Steady}) {
    EXPECT_EQ(unlisted_fields(method), std::vector<std::string>());
  }
}

// Every field of a receiver is refused, changes the map, or is named here. @see fits()
TEST(CellMethod, OfSteadyReceiversChangeTheMap) {
  simulation::Environment environment(
      city::synthetic_city({}),
      std::make_shared<test::CircularSky>(std::vector{System::GPS, System::GLONASS, System::Galileo}),
      {{System::GPS, {{1e-8, 0, 0, 0}, {9e4, 0, 0, 0}}}});
  environment.set_errors(std::make_shared<errors::SpaceErrors>(
      errors::SpaceErrorOptions(), 1, environment.sky().satellites(), environment.klobuchar()));
  simulation::ReceiverConfig receiver =
      simulation::parse_profile(std::string(simulation::built_in_profile("ublox-m8t").text), "p").receiver;
  receiver.options.filter = {};
  receiver.options.signal.shadowing.skyline.share = 0.5;
  receiver.options.signal.shadowing.environment = disturbance::ShadowingEnvironment::Suburban;
  const propagation::Propagator propagator = environment.make_propagator(receiver.propagation);
  const TileTracer tracer(environment, receiver.propagation, 0.1);
  Grid grid = Grid::covering(-24, -24, 24, 24, 6);
  const TileCells cells = tracer.cells(grid, grid.tile(0), nullptr, 2, AltitudeKind::AboveTerrain);
  DrawOptions draws;
  draws.draws = 4;
  const auto fits = [&](const ReceiverOptions& options) {
    simulation::ReceiverConfig config = receiver;
    config.options = options;
    return heatmap::fits(CellMethod::Steady, config);
  };
  const auto solve = [&](const ReceiverOptions& options) {
    simulation::ReceiverConfig config = receiver;
    config.options = options;
    Maps maps(kLayers.size(), std::vector<float>(cells.state.size()));
    const std::vector<std::span<float>> spans(maps.begin(), maps.end());
    SteadyReceivers(environment, propagator, config, draws, {}, 6)
        .solve(cells, test::CircularSky::kEpoch + std::chrono::hours(5), kLayers, spans);
    return maps;
  };
  // The name, which is none; carriers, epochs that follow, Doppler and warnings; then what is switched off
  // here, what the clock of a system takes, the band that is not tracked, motion, foliage, and a threshold
  // below all signals of these cells.
  change_each(
      receiver.options, fits, solve,
      "own_draws at_once clock. spoofing_check. signal.pll. signal.fll. signal.phase_threshold_dbhz "
      "signal.dll.peak_check_s signal.lock.cold_acquisition_s signal.lock.reacquisition_s "
      "signal.lock.hold_s signal.lock.memory_s signal.lock.warm_start noise.doppler_sigma_hz smoothing. "
      "max_iterations convergence_m biases.drift_time_s position_filter. raim. noise.drift. "
      "ionosphere_sigma_m weights.elevation_a_m weights.elevation_b_m signal.shadowing.custom. "
      "biases.code_m biases.drift_sigma_m signal.antenna_lower_rows "
      "signal.wide_front_end_bandwidth_hz signal.front_end_compression_dbm noise.mu_m "
      "signal.shadowing.correlation_m "
      "signal.shadowing.obstacle_speed_mps signal.strength.foliage signal.lock.tracking_threshold_dbhz");
}

TEST(CellMethod, OfTheCellSolverChangeTheMap) {
  test::TileScene scene({System::GPS, System::Galileo}, geodesy::Geodetic::from_degrees(22.3, 114.18, 30));
  scene.klobuchar = {{System::GPS, {{1e-8, 0, 0, 0}, {9e4, 0, 0, 0}}}};
  scene.lay({-16, -16}, 2, 16, 16, 15);
  scene.look(geodesy::radians(5));
  scene.receive(0.5, 0.2, 60, 3);
  DrawOptions draws;
  draws.draws = 4;
  const auto solve = [&](const ReceiverOptions& options) {
    return test::solve(CellSolver(options, draws, scene.klobuchar), scene.cells, scene.signals, kLayers);
  };
  ReceiverOptions base;
  base.fix.max_iterations = 30;
  base.noise.drift_enabled = true;
  base.noise.drift_below_los = 9;
  base.fix.weights.weighting = positioning::Weighting::Elevation;
  const auto fits = [](const ReceiverOptions& options) {
    simulation::ReceiverConfig config;
    config.options = options;
    return heatmap::fits(CellMethod::Shared, config);
  };
  // Strength and what belongs to it, the clock, warnings, Doppler, what is switched off, how far the
  // iteration goes, the speed that cells do not have, and what TileTracer leaves out.
  change_each(base, fits, solve,
              "signal. cn0_mask_dbhz weights.cn0_floor_m2 weights.cn0_scale_m2_hz "
              "own_draws clock. spoofing_check. noise.doppler_sigma_hz position_filter. raim. max_iterations "
              "convergence_m noise.drift.below_speed_mps noise.drift.below_los tracks leaves_out at_once");
}

}  // namespace
}  // namespace canyon::heatmap
