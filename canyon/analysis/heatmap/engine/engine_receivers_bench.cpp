// CPU time of a cell of a map of commercial receivers, and differences of its layers from those of running
// receivers: sampled tiles of Hong Kong and of the synthetic city at 2 m, a profile with its own propagation,
// all layers, eight realizations.
//   heatmap_engine_engine_receivers_bench [profile=ublox-m8t] [city=bench|synthetic]
//   [models=run|steady_state|both]
//     [sky=recorded|nominal] [stride=61: every 61st tile] [tile=32] [spacing=2] [altitude=2] [draws=8]
//     [nodes=6]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "canyon/analysis/heatmap/engine/engine.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "tests/support/bench_city.hpp"
#include "tests/support/source_dir.hpp"

namespace canyon::heatmap {
namespace {

struct Sampled {
  double cpu_s = 0;
  std::size_t cells = 0, computed = 0;
  std::vector<std::vector<float>> of;  ///< [layer][computed cell]
};

Sampled sample(const Heatmap& map, std::size_t stride) {
  Sampled result;
  const std::size_t layers = map.request().layers.size();
  result.of.resize(layers);
  for (std::size_t i = stride / 2; i < map.unit_count(); i += stride) {
    const std::clock_t start = std::clock();
    const TileValues values = map.compute(i);
    result.cpu_s += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    const std::size_t count = values.state.size();
    result.cells += count;
    for (std::size_t c = 0; c < count; ++c) {
      if (values.state[c] != CellState::Computed) continue;
      ++result.computed;
      for (std::size_t l = 0; l < layers; ++l) result.of[l].push_back(values.values[l * count + c]);
    }
  }
  return result;
}

void describe(const char* what, const Sampled& s) {
  std::printf(
      "%s: %zu cells, %zu computed, %.1f us of CPU for each (computed: %.1f us), %.0f cells/s on two cores\n",
      what, s.cells, s.computed, 1e6 * s.cpu_s / static_cast<double>(s.cells),
      1e6 * s.cpu_s / static_cast<double>(s.computed), 2 * static_cast<double>(s.cells) / s.cpu_s);
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

void compare(const std::vector<Layer>& layers, const Sampled& run, const Sampled& steady) {
  std::printf("| layer | | mean | median | 95 %% | cell by cell: median, 95 %% of the difference |\n");
  for (std::size_t l = 0; l < layers.size(); ++l) {
    if (layers[l] == Layer::SkyView) continue;
    std::vector<double> a, b, apart;
    for (std::size_t i = 0; i < run.of[l].size(); ++i) {
      const double x = run.of[l][i], y = steady.of[l][i];
      if (std::isfinite(x)) a.push_back(x);
      if (std::isfinite(y)) b.push_back(y);
      if (std::isfinite(x) && std::isfinite(y)) apart.push_back(std::abs(x - y));
    }
    for (auto* values : {&a, &b, &apart}) std::sort(values->begin(), values->end());
    if (a.empty() || b.empty() || apart.empty()) continue;
    std::printf("| %s | run | %.4g | %.4g | %.4g | |\n", std::string(info(layers[l]).name).c_str(), mean(a),
                *quantile(a, 0.5), *quantile(a, 0.95));
    std::printf("| | steady state | %.4g (%+.1f %%) | %.4g (%+.1f %%) | %.4g (%+.1f %%) | %.3g, %.3g |\n",
                mean(b), 100 * (mean(b) / mean(a) - 1), *quantile(b, 0.5),
                100 * (*quantile(b, 0.5) / *quantile(a, 0.5) - 1), *quantile(b, 0.95),
                100 * (*quantile(b, 0.95) / *quantile(a, 0.95) - 1), *quantile(apart, 0.5),
                *quantile(apart, 0.95));
  }
}

/// The recorded drive's satellites if available, GPS and BeiDou; else nominal ones of four systems.
std::shared_ptr<const orbit::Sky> sky(bool recorded, geodesy::GpsTime& time) {
  const auto drive = std::filesystem::path(canyon_source_dir) / "../shared/data/urbannav-tst-20190428";
  if (recorded && std::filesystem::exists(drive)) {
    time = geodesy::GpsTime::from_week(2051, 46'900);
    return std::make_shared<orbit::BroadcastSky>(
        rinex::read_rinex_navigation({drive / "hksc1180.19n", drive / "hksc1180.19b"}));
  }
  time = geodesy::GpsTime::from_week(2399, 388'800);  // 2025-12-25 12:00 GPST
  return std::make_shared<orbit::BroadcastSky>(orbit::nominal_constellation(
      time, time + 86'400.0,
      {gnss::System::GPS, gnss::System::GLONASS, gnss::System::Galileo, gnss::System::BeiDou}));
}

/// The value of "name=value" among the arguments.
std::string argument(int argc, char** argv, const std::string& name, const std::string& otherwise) {
  for (int i = 1; i < argc; ++i) {
    const std::string text = argv[i];
    if (text.rfind(name + "=", 0) == 0) return text.substr(name.size() + 1);
  }
  return otherwise;
}

int main(int argc, char** argv) {
  const auto given = [&](const char* name, const char* otherwise) {
    return argument(argc, argv, name, otherwise);
  };
  const std::string profile = given("profile", "ublox-m8t");
  const bool synthetic = given("city", "bench") == "synthetic";
  const auto stride = std::strtoul(given("stride", "61").c_str(), nullptr, 10);
  geodesy::GpsTime time;
  const auto satellites = sky(!synthetic && given("sky", "recorded") == "recorded", time);
  const simulation::Environment environment(synthetic ? city::synthetic_city({}) : bench::bench_city().city,
                                            satellites);
  const city::Box bounds = environment.city().bounds();
  Request request;
  request.grid = Grid::covering(bounds.min.x(), bounds.min.y(), bounds.max.x(), bounds.max.y(),
                                std::atof(given("spacing", "2").c_str()));
  request.grid.tile_size = static_cast<std::uint32_t>(std::atoi(given("tile", "32").c_str()));
  request.times = {time};
  request.altitudes_m = {std::atof(given("altitude", "2").c_str())};
  request.layers.clear();
  request.layers = layers_of_one_look();
  request.samples.samples = std::atoi(given("draws", "8").c_str());
  simulation::ReceiverConfig receiver =
      simulation::parse_profile(std::string(simulation::built_in_profile(profile).text), profile).receiver;
  receiver.options.fix.elevation_mask_rad = geodesy::radians(10);
  // The fraction of the recorded drive's scenario.
  receiver.options.signal.shadowing.skyline.fraction = 0.4;
  const std::string models = given("models", "both");
  Sampled run;
  if (models != "steady_state") {
    request.receivers.model = ReceiverModel::Run;
    run = sample(Heatmap(environment, receiver, request, ""), stride);
    describe("run", run);
  }
  if (models == "run") return 0;
  request.receivers.model = ReceiverModel::SteadyState;
  request.receivers.path_nodes_m = std::atof(given("nodes", "6").c_str());
  const Sampled steady = sample(Heatmap(environment, receiver, request, ""), stride);
  describe("steady state", steady);
  if (run.computed > 0) compare(request.layers, run, steady);
  return 0;
}

}  // namespace
}  // namespace canyon::heatmap

int main(int argc, char** argv) {
  return canyon::heatmap::main(argc, argv);
}
