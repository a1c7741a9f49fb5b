// Heat maps compared with other results of Canyon at the same points: a scenario's receiver, run alone at
// cells of a map that was written to a file and read back.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "canyon/analysis/heatmap/engine/engine.hpp"
#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/analysis/heatmap/engine/map_summary.hpp"
#include "canyon/analysis/heatmap/files/netcdf_writer.hpp"
#include "canyon/analysis/heatmap/files/stored_map.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::heatmap_test {
namespace {

namespace fs = std::filesystem;
using heatmap::CellState;
using heatmap::Layer;

constexpr double kAltitude_m = 2;
const std::vector<Layer> kLayers{Layer::HorizontalError, Layer::VerticalError, Layer::Hdop,
                                 Layer::SatellitesVisible, Layer::SatellitesUsed};

std::string scenario_at(const std::string& model, double east_m, double north_m) {
  return fmt::format(R"(
city: {{synthetic: {{blocks_east: 4, blocks_north: 4, seed: 5}}}}
sky: {{nominal: true, systems: [GPS, Galileo]}}
start: 2026-03-01T10:00:00Z
trajectory: {{waypoints: [{{east_m: {}, north_m: {}, up_m: {}}}]}}
duration_s: 0
rate_hz: 1
propagation: {{model: {}}}
receivers: [{{name: rover, profile: ideal, elevation_mask_deg: 10}}]
)",
                     east_m, north_m, kAltitude_m, model);
}

class HeatmapAndReceivers : public ::testing::TestWithParam<std::string> {};

TEST_P(HeatmapAndReceivers, CellsAreWhatAReceiverThereFinds) {
  const test::TemporaryFolder folder;
  const simulation::Simulation scenario = test::prepare(scenario_at(GetParam(), 0, 0), folder.path());
  heatmap::Request request;
  request.grid = heatmap::Grid::covering(-60, -60, 60, 60, 2);
  request.altitudes_m = {kAltitude_m, 15};
  request.times = {scenario.begin()};
  request.layers = kLayers;
  const heatmap::Heatmap map(scenario.environment(), scenario.scenario().receivers.front(), request, "test");
  heatmap::TileStore store(folder / "tiles", map.key(), "test");
  map.run(store);
  heatmap::MapSource source;
  source.request = &request;
  source.frame = scenario.environment().city().frame;
  source.slice = heatmap::store_slices(map, store);
  const heatmap::MapSummary summary = heatmap::summarize(source);
  heatmap::write_netcdf(folder / "map.nc", source);
  const heatmap::StoredMap stored(folder / "map.nc");

  int points = 0, alike = 0, indoors = 0;
  double worst_m = 0;
  for (std::uint32_t row = 1; row < request.grid.rows; row += 4) {
    for (std::uint32_t column = 2; column < request.grid.columns; column += 4) {
      const Eigen::Vector2d centre = request.grid.centre(column, row);
      const auto result = stored.at(centre, kAltitude_m, scenario.begin());
      ASSERT_TRUE(result);
      const simulation::Simulation one =
          test::prepare(scenario_at(GetParam(), centre.x(), centre.y()), folder.path());
      test::Recorder recorder;
      one.run({&recorder});
      ASSERT_EQ(recorder.epochs.size(), 1U);
      const simulation::Epoch& epoch = recorder.epochs.front();
      if (epoch.containment != raytrace::Containment::Free) {
        EXPECT_EQ(result->state, CellState::InsideBuilding) << centre.transpose();
        ++indoors;
        continue;
      }
      EXPECT_EQ(result->state, CellState::Computed) << centre.transpose();
      ++points;
      const positioning::Fix& fix = epoch.observed.fix;
      const bool counts = result->values[3] == static_cast<float>(epoch.observed.visible) &&
                          result->values[4] == static_cast<float>(fix.used.size());
      if (!counts) continue;
      if (!fix.solved()) {
        alike += std::isnan(result->values[0]) && std::isnan(result->values[2]) ? 1 : 0;
        continue;
      }
      const double off_m = std::max(std::abs(result->values[0] - epoch.error_enu_m.head<2>().norm()),
                                    std::abs(result->values[1] - epoch.error_enu_m.z()));
      // The tile's directions differ from a cell's own by 4e-6 rad (85 m over 20,000 km), which is 1 mm at a
      // wall 300 m away.
      if (off_m > 0.01 || std::abs(result->values[2] / fix.dop->hdop - 1) > 1e-3) continue;
      ++alike;
      worst_m = std::max(worst_m, off_m);
    }
  }
  std::cout << GetParam() << ": " << alike << " of " << points << " places alike, errors within " << worst_m
            << " m; " << indoors << " indoors\n";
  EXPECT_GE(points, 40);
  EXPECT_GE(indoors, 5);
  // At an edge of a shadow both results are accepted; such cells are few.
  EXPECT_GE(alike, points - points / 25);
  EXPECT_EQ(summary.missing, 0U);
  EXPECT_EQ(summary.cells, 2 * request.grid.cells());
  EXPECT_EQ(summary.in_state(CellState::Computed) + summary.in_state(CellState::InsideBuilding),
            summary.cells);
}

INSTANTIATE_TEST_SUITE_P(Models, HeatmapAndReceivers, ::testing::Values("mirror", "specular"),
                         [](const auto& model) { return model.param; });

}  // namespace
}  // namespace canyon::heatmap_test
