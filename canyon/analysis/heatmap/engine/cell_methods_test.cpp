#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "canyon/analysis/heatmap/cells/cell_solver.hpp"
#include "canyon/analysis/heatmap/engine/engine.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "tests/support/circular_sky.hpp"
#include "tests/support/downtown.hpp"

namespace canyon::heatmap::cell_methods_test {
namespace {

using simulation::ReceiverConfig;
using test::CircularSky;
using test::downtown;

constexpr geodesy::GpsTime kTime = CircularSky::kEpoch + std::chrono::hours(5);

ReceiverConfig sold(const char* profile) {
  ReceiverConfig receiver =
      simulation::parse_profile(std::string(simulation::built_in_profile(profile).text), profile).receiver;
  receiver.options.signal.shadowing.enabled = true;
  receiver.options.signal.shadowing.environment = disturbance::ShadowingEnvironment::Auto;
  receiver.options.signal.shadowing.skyline.fraction = 0.4;
  return receiver;
}

/// Layers of sampled tiles, [layer][computed cell].
using Values = std::vector<std::vector<double>>;

/// Tiles of 8 cells at 2 m, every so many, over the middle of downtown.
Values sample_map(const ReceiverConfig& receiver, const CellReceiverOptions& how, std::size_t stride,
                  std::vector<Layer> layers, double across_m) {
  Request request;
  request.grid = Grid::covering(-across_m / 2, -across_m / 2, across_m / 2, across_m / 2, 2);
  request.grid.tile_size = 8;
  request.times = {kTime};
  request.altitudes_m = {2};
  request.samples.samples = 8;
  request.receivers = how;
  request.layers = std::move(layers);
  const Heatmap map(downtown(), receiver, request, "");
  Values values(request.layers.size());
  for (std::size_t i = stride / 2; i < map.unit_count(); i += stride) {
    const TileValues tile = map.compute(i);
    for (std::size_t c = 0; c < tile.state.size(); ++c) {
      if (tile.state[c] != CellState::Computed) continue;
      for (std::size_t l = 0; l < values.size(); ++l) {
        values[l].push_back(static_cast<double>(tile.values[l * tile.state.size() + c]));
      }
    }
  }
  return values;
}

std::vector<double> finite(const std::vector<double>& values) {
  std::vector<double> result;
  std::copy_if(values.begin(), values.end(), std::back_inserter(result),
               [](double value) { return std::isfinite(value); });
  return result;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

constexpr CellReceiverOptions kRun{ReceiverModel::Run, 0};

// The reference is receiver::Receiver, in every cell and realization. Paths are traced at every cell, so the
// remaining differences are single precision, directions of the tile's centre and the linear fix. Without
// unmapped obstacles, which are computed for directions in steps of 1.4 deg.
TEST(CellMethods, AreTheReceiversThemselvesWherePathsAreTracedInEveryCell) {
  const std::vector<Layer> layers{
      Layer::HorizontalError,      Layer::VerticalError,       Layer::Hdop,
      Layer::SatellitesVisible,    Layer::SatellitesUsed,      Layer::SatellitesLos,
      Layer::SatellitesBlocked,    Layer::NlosFraction,        Layer::LargestExcess,
      Layer::Availability,         Layer::HorizontalErrorMean, Layer::VerticalErrorRms,
      Layer::ProtectionLevel,      Layer::MisleadingFraction,  Layer::HorizontalErrorExceedance,
      Layer::ProtectedAvailability};
  for (const char* profile : {"ublox-m8t", "phone"}) {
    ReceiverConfig receiver = sold(profile);
    receiver.options.filter = {};
    receiver.options.signal.shadowing.skyline.fraction = 0;
    ASSERT_EQ(cell_method(receiver), CellMethod::Steady);
    const Values run = sample_map(receiver, kRun, 23, layers, 200);
    const Values steady = sample_map(receiver, {ReceiverModel::SteadyState, 0}, 23, layers, 200);
    ASSERT_GT(run[0].size(), 200U);
    for (std::size_t l = 0; l < layers.size(); ++l) {
      std::size_t alike = 0;
      for (std::size_t i = 0; i < run[l].size(); ++i) {
        const double a = run[l][i], b = steady[l][i];
        const double near =
            info(layers[l]).needs_samples ? 0.05 + 0.05 * std::abs(a) : 0.02 + 0.002 * std::abs(a);
        alike += (std::isnan(a) && std::isnan(b)) || std::abs(a - b) < near;
      }
      const double fraction = static_cast<double>(alike) / static_cast<double>(run[l].size());
      std::cout << profile << ", " << info(layers[l]).name << ": " << fraction << " of " << run[l].size()
                << " cells alike\n";
      EXPECT_GT(fraction, 0.97) << info(layers[l]).name;
    }
  }
}

// With nodes 6 m apart: medians of errors over cells within 6 %, their 95th percentiles within 20 %: facade
// pieces that scatter differently are hardly longer than the distance of nodes, and obstacles are those
// around the node. Availability within 1.5 %. docs/heatmap.md has the same for larger samples, and for Hong
// Kong.
TEST(CellMethods, HoldTheirBoundsBetweenNodes) {
  const std::vector<Layer> layers{Layer::HorizontalErrorP50, Layer::HorizontalErrorP95,
                                  Layer::HorizontalErrorMean, Layer::VerticalErrorP50, Layer::Availability};
  const ReceiverConfig receiver = sold("ublox-m8t");
  const Values run = sample_map(receiver, kRun, 19, layers, 560);
  const Values steady = sample_map(receiver, {}, 19, layers, 560);
  for (std::size_t l = 0; l < layers.size(); ++l) {
    const std::vector<double> a = finite(run[l]), b = finite(steady[l]);
    if (layers[l] == Layer::Availability) {
      EXPECT_NEAR(mean(b), mean(a), 0.015);
      continue;
    }
    for (const double p : {0.5, 0.95}) {
      const double expected = *quantile(a, p), found = *quantile(b, p);
      std::cout << info(layers[l]).name << ", " << p << " of " << a.size() << " cells: " << expected
                << " m run, " << found << " m in steady state\n";
      // The extreme tail depends on single obstacles, which are those around the middle of a block.
      const double within = p == 0.5 ? 0.06 : 0.2;
      EXPECT_NEAR(found, expected, within * expected) << info(layers[l]).name << " " << p;
    }
  }
}

// Under an open sky only range errors remain, and those of the data sheet; running receivers have the same
// random numbers.
TEST(CellMethods, HaveErrorsFromSpaceInEachDraw) {
  simulation::Environment environment(city::City{},
                                      std::make_shared<CircularSky>(std::vector{
                                          gnss::System::GPS, gnss::System::Galileo, gnss::System::BeiDou}),
                                      {{gnss::System::GPS, {{1e-8, 0, 0, 0}, {9e4, 0, 0, 0}}}});
  ReceiverConfig receiver = sold("ublox-m10");
  Request request;
  request.grid = Grid::covering(0, 0, 2, 2, 2);
  request.times = {kTime};
  request.altitudes_m = {2};
  request.altitude_kind = AltitudeKind::Ellipsoid;
  request.samples.samples = 64;
  request.layers = {Layer::HorizontalError, Layer::HorizontalErrorP50};
  const auto map = [&](ReceiverModel model) {
    request.receivers = {model, 0};
    return Heatmap(environment, receiver, request, "").compute(0).values;
  };
  environment.set_errors(std::make_shared<sky::RangeErrorModel>(
      sky::RangeErrorOptions(), 1, environment.sky().satellites(), environment.klobuchar()));
  const std::vector<float> steady = map(ReceiverModel::SteadyState), run = map(ReceiverModel::Run);
  EXPECT_NEAR(steady[0], 0, 1e-3);
  EXPECT_NEAR(run[0], 0, 1e-3);
  EXPECT_NEAR(steady[1], run[1], 0.01);
  EXPECT_GT(steady[1], 0.7);
  EXPECT_LT(steady[1], 3);
  receiver.options.signal.enabled = receiver.options.noise.enabled = false;
  receiver.options.filter = {};
  receiver.options.fix.weights.weighting = positioning::Weighting::Elevation;
  ASSERT_EQ(cell_method(receiver), CellMethod::Shared);
  const std::vector<float> shared = map(ReceiverModel::SteadyState);
  ReceiverConfig without_strength = receiver;
  receiver.options.fix.max_iterations = 19;
  ASSERT_EQ(cell_method(receiver), CellMethod::Run);
  EXPECT_NEAR(shared[1], map(ReceiverModel::Run)[1], 0.01);
  EXPECT_GT(shared[1], 0.5);
  environment.set_errors(nullptr);
  receiver = without_strength;
  EXPECT_LT(map(ReceiverModel::SteadyState)[1], 1e-3);
  receiver = sold("ublox-m10");
  EXPECT_LT(map(ReceiverModel::SteadyState)[1], 0.7F * steady[1]);
}

// Measurements report range errors in addition to their noise; weights by sigma and protection levels use
// both.
TEST(CellMethods, StateErrorsFromSpace) {
  simulation::Environment environment(
      city::City{}, std::make_shared<CircularSky>(std::vector{gnss::System::GPS, gnss::System::Galileo}),
      {{gnss::System::GPS, {{1e-8, 0, 0, 0}, {9e4, 0, 0, 0}}}});
  environment.set_errors(std::make_shared<sky::RangeErrorModel>(
      sky::RangeErrorOptions(), 1, environment.sky().satellites(), environment.klobuchar()));
  ReceiverConfig receiver = sold("ublox-m10");
  receiver.options.fix.weights.weighting = positioning::Weighting::Sigma;
  Request request;
  request.grid = Grid::covering(0, 0, 2, 2, 2);
  request.times = {kTime};
  request.altitudes_m = {2};
  request.altitude_kind = AltitudeKind::Ellipsoid;
  request.layers = {Layer::ProtectionLevel};
  const auto level_m = [&](ReceiverModel model) {
    request.receivers = {model, 0};
    return Heatmap(environment, receiver, request, "").compute(0).values[0];
  };
  const float run_m = level_m(ReceiverModel::Run);
  EXPECT_GT(run_m, 3);  // 6 of a deviation of 1 m
  EXPECT_NEAR(level_m(ReceiverModel::SteadyState), run_m, 0.01F * run_m);
}

TEST(CellMethods, AreTheSameOnAnyNumberOfThreads) {
  Request request;
  request.grid = Grid::covering(-40, -40, 40, 40, 2);
  request.grid.tile_size = 40;
  request.times = {kTime};
  request.altitudes_m = {2};
  request.samples.samples = 3;
  request.layers = {Layer::HorizontalErrorP95, Layer::Availability, Layer::LargestExcess};
  const Heatmap map(downtown(), sold("ublox-m10"), request, "");
  std::vector<float> first;
  for (const int threads : {1, 2, 3}) {
    tbb::task_arena arena(threads);
    std::vector<float> values;
    arena.execute([&] { values = map.compute(0).values; });
    if (first.empty()) first = values;
    ASSERT_EQ(values.size(), first.size());
    EXPECT_EQ(std::memcmp(values.data(), first.data(), values.size() * sizeof(float)), 0);
  }
}

TEST(CellMethods, LeaveOthersToThoseThatRun) {
  ReceiverConfig receiver = sold("ublox-m8t");
  receiver.options.filter = {};
  EXPECT_EQ(cell_method(receiver), CellMethod::Steady);
  ReceiverConfig raim = receiver;
  raim.options.fix.raim.enabled = true;
  EXPECT_EQ(cell_method(raim), CellMethod::Run);
  ReceiverConfig in_street = receiver;
  in_street.streets.enabled = true;
  EXPECT_EQ(cell_method(in_street), CellMethod::Run);
  ReceiverConfig mirror = receiver;
  mirror.propagation.model = propagation::Model::Mirror;
  EXPECT_EQ(cell_method(mirror), CellMethod::Run);
  CellReceiverOptions far;
  far.path_nodes_m = 101;
  EXPECT_THROW(options::check(far, "map's receivers"), InputError);
}

}  // namespace
}  // namespace canyon::heatmap::cell_methods_test
