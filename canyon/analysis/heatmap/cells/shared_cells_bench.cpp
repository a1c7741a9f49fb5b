// Time of the cells of a map from the arriving signals: layers of one fix, layers over 64 noise realizations,
// and positioning::solve_fix() at each cell for comparison.
#include "canyon/analysis/heatmap/cells/shared_cells.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "tests/support/tile_scene.hpp"

namespace canyon::heatmap {
namespace {

using gnss::System;

/// A tile of 256 x 256 cells at 1 m. Each satellite is blocked in its own pattern, stripes some tens of
/// metres wide like shadows of rows of houses; a reflection reaches two thirds of the blocked cells, with an
/// excess that changes from cell to cell.
void fill(test::TileScene& scene, std::size_t satellites) {
  scene.lay({-128, -128}, 1, 256, 256, 15);
  scene.compute_sky(geodesy::radians(10));
  const std::size_t n = std::min(satellites, scene.signals.satellites.size());
  scene.signals.satellites.resize(n);
  scene.signals.directions.resize(n);
  scene.signals.visibility.resize(n);
  scene.signals.excess_m.resize(n);
  for (std::size_t k = 0; k < n; ++k) {
    const auto d = static_cast<double>(k);
    for (std::size_t i = 0; i < scene.cells.tile.cells(); ++i) {
      const Eigen::Vector3d point = scene.centre(i);
      const double phase = (point.x() * std::cos(d) + point.y() * std::sin(d)) / (8 + d) + d;
      const bool direct = std::sin(phase) < 0.2, reflected = std::sin(0.37 * phase + 1) < 0.5;
      scene.signals.visibility[k][i] = direct      ? CellVisibility::LOS
                                       : reflected ? CellVisibility::NLOS
                                                   : CellVisibility::Blocked;
      scene.signals.excess_m[k][i] =
          direct || !reflected ? 0
                               : static_cast<float>(50 + 50 * std::sin(0.1 * point.x() + 0.2 * point.y()));
    }
  }
}

const test::TileScene& scene(bool many) {
  static const auto make = [](std::size_t satellites, const std::vector<System>& systems) {
    auto* made = new test::TileScene(systems, geodesy::Geodetic::from_degrees(22.3, 114.18, 30));
    fill(*made, satellites);
    return made;
  };
  static const test::TileScene& few = *make(10, {System::GPS, System::Galileo});
  static const test::TileScene& all =
      *make(128, {System::GPS, System::GLONASS, System::Galileo, System::BeiDou});
  return many ? all : few;
}

double solve_s(const test::TileScene& scene, const receiver::ReceiverOptions& options,
               const std::vector<Layer>& wanted) {
  const SharedReceiver receiver{options, {}, {}, {}};
  std::vector<std::vector<float>> maps(wanted.size(), std::vector<float>(scene.cells.state.size()));
  const std::vector<std::span<float>> spans(maps.begin(), maps.end());
  // Processor time, since the machine may be shared.
  const std::clock_t start = std::clock();
  solve_shared(receiver, scene.cells, scene.time, scene.signals, wanted, spans);
  benchmark::DoNotOptimize(maps.front().front());
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

const std::vector<Layer> kOnce{Layer::HorizontalError,   Layer::VerticalError, Layer::Hdop, Layer::Pdop,
                               Layer::SatellitesVisible, Layer::Availability};
const std::vector<Layer> kRendered{Layer::HorizontalErrorMean, Layer::HorizontalErrorRms,
                                   Layer::HorizontalErrorP50,  Layer::HorizontalErrorP95,
                                   Layer::VerticalErrorRms,    Layer::VerticalErrorP95};

/// state.range(0): 0: 10 satellites, 1: all of four systems; state.range(1): 1: troposphere corrected;
/// `times`: how often one solve_fix() fits into a cell's time.
void cells(benchmark::State& state, const std::vector<Layer>& wanted) {
  const test::TileScene& from = scene(state.range(0) != 0);
  receiver::ReceiverOptions options;
  options.troposphere = options.fix.correct_troposphere = state.range(1) != 0;
  double solver_s = 0;
  std::size_t solved = 0;
  for (auto _ : state) {
    const double seconds = solve_s(from, options, wanted);
    state.SetIterationTime(seconds);
    solver_s += seconds;
    solved += from.cells.state.size();
  }
  double fix_s = 0;
  int fixes = 0;
  constexpr std::size_t kSolves = 500;
  for (std::size_t i = 0; i < kSolves; ++i) {
    const test::TileScene::Result result = from.reference_fix((i * 317) % 65'536, options);
    fix_s += result.solving_s;
    fixes += result.fix.solved();
  }
  state.counters["with_fix"] = fixes / static_cast<double>(kSolves);
  state.counters["satellites"] = static_cast<double>(from.signals.satellites.size());
  state.counters["cells"] = benchmark::Counter(static_cast<double>(solved), benchmark::Counter::kIsRate);
  state.counters["per_solve_fix"] = fix_s / kSolves / (solver_s / static_cast<double>(solved));
}
BENCHMARK_CAPTURE(cells, once, kOnce)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond)
    ->Args({0, 0})
    ->Args({0, 1})
    ->Args({1, 0});
BENCHMARK_CAPTURE(cells, samples, kRendered)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond)
    ->Args({0, 0})
    ->Args({0, 1})
    ->Args({1, 0});

}  // namespace
}  // namespace canyon::heatmap

BENCHMARK_MAIN();
