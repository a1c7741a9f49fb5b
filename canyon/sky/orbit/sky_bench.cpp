#include "canyon/sky/orbit/sky.hpp"

#include <benchmark/benchmark.h>

#include <set>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"

namespace canyon::orbit {
namespace {

const geodesy::GpsTime kBegin = geodesy::parse_time("2026-06-01T12:00:00Z");

/// All satellites of the nominal sky, received by one antenna at one instant.
void lines_of_sight(benchmark::State& state, const std::set<gnss::System>& systems) {
  const BroadcastSky sky(nominal_constellation(kBegin, kBegin + 3600.0, systems));
  const std::vector<gnss::SatelliteId> ids = sky.satellites();
  const Eigen::Vector3d antenna =
      geodesy::ecef_from_geodetic(geodesy::Geodetic::from_degrees(22.298251, 114.178761, 5));
  double t = 0;
  for (auto _ : state) {
    const Observer observer(antenna);
    for (const gnss::SatelliteId id : ids) {
      benchmark::DoNotOptimize(line_of_sight(sky, id, kBegin + t, observer));
    }
    t = t < 3500 ? t + 1 : 0;
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(ids.size()));
}

BENCHMARK_CAPTURE(lines_of_sight, gps, std::set<gnss::System>{gnss::System::GPS});
BENCHMARK_CAPTURE(lines_of_sight, glonass, std::set<gnss::System>{gnss::System::GLONASS});
BENCHMARK_CAPTURE(lines_of_sight, all,
                  std::set<gnss::System>{gnss::System::GPS, gnss::System::GLONASS, gnss::System::Galileo,
                                         gnss::System::BeiDou});

void make_a_day(benchmark::State& state) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(nominal_constellation(
        kBegin, kBegin + 86'400.0,
        {gnss::System::GPS, gnss::System::GLONASS, gnss::System::Galileo, gnss::System::BeiDou}));
  }
}
BENCHMARK(make_a_day)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace canyon::orbit

BENCHMARK_MAIN();
