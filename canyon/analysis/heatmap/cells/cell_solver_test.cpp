#include "canyon/analysis/heatmap/cells/cell_solver.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/analysis/heatmap/cells/shared_cells.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/support/option_values.hpp"
#include "tests/support/tile_scene.hpp"

namespace canyon::heatmap {
namespace {

using gnss::System;
using receiver::ReceiverOptions;
using test::Maps;

const std::vector<Layer> kLayers{Layer::HorizontalError,     Layer::VerticalError,     Layer::Pdop,
                                 Layer::SatellitesUsed,      Layer::SatellitesVisible, Layer::Availability,
                                 Layer::HorizontalErrorMean, Layer::VerticalErrorMean, Layer::NlosFraction,
                                 Layer::ProtectionLevel};

ReceiverOptions with(const ReceiverOptions& options, const options::Key& key) {
  ReceiverOptions changed = options;
  options::Document document;
  document.known = options::describe(options).paths();
  std::string value = test::another_value(key);
  if (key.path == "elevation_mask_deg") value = "40";
  if (key.path == "signal.lock.acquisition_threshold_dbhz") value = "36";
  if (key.path == "signal.installation_db") value = "-20";
  if (key.path == "signal.shadowing.skyline.obstacle_fraction") value = "0.3";
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

CellMethod method_of(const ReceiverOptions& options) {
  simulation::ReceiverConfig config;
  config.options = options;
  config.propagation.model = propagation::Model::Specular;
  return cell_method(config);
}

/// Fields that change only epochs after the first fix of a receiver at rest that has run before. A name with
/// a point at its end means all fields below it. Add a new option of receivers here only if a running
/// receiver has the same first fix with another value (LaterFieldsDoNotChangeAFirstFix).
constexpr std::string_view kLater =
    "position_filter. max_iterations convergence_m ionosphere_sigma_m smoothing. raim.false_alarm "
    "raim.max_exclusions clock. spoofing_check. noise.doppler_sigma_hz biases.drift_time_s "
    "signal.front_end_compression_dbm signal.dll.peak_check_s signal.pll. signal.fll. "
    "signal.phase_threshold_dbhz signal.cn0_averaging_s signal.lock.cold_acquisition_s "
    "signal.lock.reacquisition_s "
    "signal.lock.hold_s signal.lock.memory_s signal.lock.warm_start";
/// Fields of parts that require running the receiver if enabled.
constexpr std::string_view kOfRuns = "corrections. rtk. dead_reckoning.";

/// Changes each field in turn. Fields that do not change the method must change the map, except those of the
/// lists above: this test fails if cells ignore a new option of receivers.
template <typename Solve>
void change_each(const ReceiverOptions& base, const Solve& solve, std::string_view without_effect) {
  const CellMethod method = method_of(base);
  const Maps before = solve(base);
  int refused = 0, moved = 0, unmoved = 0;
  for (const options::Key& key : options::describe(base).keys) {
    const ReceiverOptions changed = with(base, key);
    if (method_of(changed) != method) {
      ++refused;
      continue;
    }
    const bool moves = !same(solve(changed), before);
    ++(moves ? moved : unmoved);
    const bool expected =
        !is_listed(key.path, kLater) && !is_listed(key.path, kOfRuns) && !is_listed(key.path, without_effect);
    EXPECT_EQ(moves, expected) << key.path << (moves ? " moves" : " is ignored");
  }
  std::cout << moved << " fields change the map, " << unmoved << " do not, " << refused
            << " take another method\n";
  EXPECT_GT(refused, 5);
}

TEST(CellMethod, FollowsTheOptions) {
  const auto method = [](auto&& change) {
    ReceiverOptions options;
    change(options);
    return method_of(options);
  };
  using positioning::Weighting;
  EXPECT_EQ(method([](ReceiverOptions&) {}), CellMethod::Shared);
  EXPECT_EQ(method([](ReceiverOptions& o) { o.fix.weights.weighting = Weighting::Elevation; }),
            CellMethod::Shared);
  EXPECT_EQ(method([](ReceiverOptions& o) { o.fix.weights.weighting = Weighting::Cn0; }), CellMethod::Run);
  EXPECT_EQ(method([](ReceiverOptions& o) { o.tracks = {"L1CA"}; }), CellMethod::Shared);
  EXPECT_EQ(method([](ReceiverOptions& o) { o.biases.glonass_channel_m = 1; }), CellMethod::Shared);
  EXPECT_EQ(method([](ReceiverOptions& o) { o.clock.drift = 1e-7; }), CellMethod::Shared);
  EXPECT_EQ(method([](ReceiverOptions& o) { o.fix.max_iterations = 19; }), CellMethod::Run);
  EXPECT_EQ(method([](ReceiverOptions& o) { o.fix.raim.false_alarm = 1e-3; }), CellMethod::Shared);
  EXPECT_EQ(method([](ReceiverOptions& o) { o.signal.enabled = true; }), CellMethod::Steady);
  for (const bool strength : {false, true}) {
    const auto runs = [&](auto&& change) {
      return method([&](ReceiverOptions& o) {
               o.signal.enabled = strength;
               change(o);
             }) == CellMethod::Run;
    };
    EXPECT_TRUE(runs([](ReceiverOptions& o) { o.fix.raim.enabled = true; }));
    EXPECT_TRUE(runs([](ReceiverOptions& o) { o.filter.enabled = true; }));
    EXPECT_TRUE(runs([](ReceiverOptions& o) { o.rtk.enabled = true; }));
    EXPECT_TRUE(runs([](ReceiverOptions& o) { o.fix_input.uses = {"L1CA"}; }));
    EXPECT_TRUE(
        runs([](ReceiverOptions& o) { o.fix_input.combination = receiver::Combination::IonosphereFree; }));
    EXPECT_EQ(runs([](ReceiverOptions& o) { o.noise.drift_enabled = true; }), strength);
  }
  simulation::ReceiverConfig in_street;
  in_street.streets.enabled = true;
  EXPECT_EQ(cell_method(in_street), CellMethod::Run);
}

/// The middle of a city, for a receiver with strength at 64 cells.
class Downtown {
 public:
  Downtown() {
    environment_.set_errors(std::make_shared<sky::RangeErrorModel>(
        sky::RangeErrorOptions(), 1, environment_.sky().satellites(), environment_.klobuchar()));
    receiver_ =
        simulation::parse_profile(std::string(simulation::built_in_profile("ublox-m8t").text), "p").receiver;
    receiver_.options.filter = {};
    receiver_.options.signal.shadowing.enabled = true;
    receiver_.options.signal.shadowing.skyline.fraction = 1;
    receiver_.options.signal.dll.narrow_below_dbhz = 30;  // above the threshold of acquisition
    receiver_.options.signal.shadowing.environment = disturbance::ShadowingEnvironment::Suburban;
    samples_.samples = 4;
  }
  [[nodiscard]] const ReceiverOptions& options() const { return receiver_.options; }
  [[nodiscard]] Maps steady(const ReceiverOptions& options) const {
    return solve(CellMethod::Steady, options);
  }
  [[nodiscard]] Maps run(const ReceiverOptions& options) const { return solve(CellMethod::Run, options); }

 private:
  [[nodiscard]] Maps solve(CellMethod method, const ReceiverOptions& options) const {
    simulation::ReceiverConfig config = receiver_;
    config.options = options;
    const TileTracer tracer(environment_, receiver_.propagation, 0.1);
    const auto solver = cell_solver(method, environment_, tracer, {config, nullptr, samples_, {}, {}, {}});
    Grid grid = Grid::covering(-24, -24, 24, 24, 6);
    const TileCells cells = tracer.cells(grid, grid.tile(0), nullptr, 2, AltitudeKind::AboveTerrain);
    Maps maps(kLayers.size(), std::vector<float>(cells.state.size()));
    const std::vector<std::span<float>> spans(maps.begin(), maps.end());
    EXPECT_TRUE(solver->solve(cells, test::CircularSky::kEpoch + std::chrono::hours(5), kLayers, spans, {}));
    return maps;
  }

  simulation::Environment environment_{
      city::synthetic_city({}),
      std::make_shared<test::CircularSky>(std::vector{System::GPS, System::GLONASS, System::Galileo}),
      {{System::GPS, {{1e-8, 0, 0, 0}, {9e4, 0, 0, 0}}}}};
  simulation::ReceiverConfig receiver_;
  MonteCarloOptions samples_;
};

TEST(CellMethod, LaterFieldsDoNotChangeAFirstFix) {
  const Downtown downtown;
  const Maps before = downtown.run(downtown.options());
  int fields = 0;
  for (const options::Key& key : options::describe(downtown.options()).keys) {
    if (!is_listed(key.path, kLater) || key.path == "position_filter.enabled") continue;
    ++fields;
    const Maps after = downtown.run(with(downtown.options(), key));
    double worst = 0;
    for (std::size_t l = 0; l < kLayers.size(); ++l) {
      for (std::size_t i = 0; i < before[l].size(); ++i) {
        ASSERT_EQ(std::isnan(before[l][i]), std::isnan(after[l][i])) << key.path;
        if (std::isnan(before[l][i])) continue;
        worst = std::max(worst, std::abs(double{after[l][i]} - double{before[l][i]}));
      }
    }
    EXPECT_LT(worst, 0.01) << key.path;
  }
  EXPECT_GT(fields, 25);
}

TEST(CellMethod, OfSteadyReceiversChangeTheMap) {
  const Downtown downtown;
  // The name, which has no effect; options disabled here, terms absorbed by the clock of a system, the band
  // that is not tracked, motion, foliage, and a threshold below all signals of these cells.
  change_each(
      downtown.options(), [&](const ReceiverOptions& options) { return downtown.steady(options); },
      "independent_noise concurrent_systems noise.drift. weights.elevation_a_m weights.elevation_b_m "
      "biases.code_m biases.drift_sigma_m signal.antenna_lower_rows signal.wide_front_end_bandwidth_hz "
      "noise.mu_m "
      "signal.lock.tracking_threshold_dbhz");
}

TEST(CellMethod, OfSharedCellsChangeTheMap) {
  test::TileScene scene({System::GPS, System::Galileo}, geodesy::Geodetic::from_degrees(22.3, 114.18, 30));
  scene.klobuchar = {{System::GPS, {{1e-8, 0, 0, 0}, {9e4, 0, 0, 0}}}};
  scene.lay({-16, -16}, 2, 16, 16, 15);
  scene.compute_sky(geodesy::radians(5));
  scene.receive(0.5, 0.2, 60, 3);
  MonteCarloOptions monte_carlo;
  monte_carlo.samples = 4;
  std::vector<gnss::SatelliteId> ids;
  for (const orbit::LineOfSight& line : scene.signals.satellites) ids.push_back(line.id);
  const auto space =
      std::make_shared<sky::RangeErrorModel>(sky::RangeErrorOptions(), 1, ids, scene.klobuchar);
  const auto solve = [&](const ReceiverOptions& options) {
    return test::solve(SharedReceiver{options, monte_carlo, scene.klobuchar, {}, space}, scene, kLayers);
  };
  ReceiverOptions base;
  base.fix.max_iterations = 30;
  base.noise.drift_enabled = true;
  base.fix.weights.weighting = positioning::Weighting::Elevation;
  // Strength and its options, residuals, the name, GLONASS, the speed (cells have none), and the effects that
  // TileTracer leaves out.
  change_each(base, solve,
              "signal. cn0_mask_dbhz covariance_by_residuals "
              "independent_noise biases.glonass_channel_m "
              "elevation_mask_deg tracks exclude_signals concurrent_systems");
}

}  // namespace
}  // namespace canyon::heatmap
