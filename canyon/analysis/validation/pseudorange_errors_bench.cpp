#include "canyon/analysis/validation/pseudorange_errors.hpp"
#include "canyon/analysis/validation/receiver_clock.hpp"

#include <benchmark/benchmark.h>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/receiver/tracking/noise.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "tests/support/circular_sky.hpp"

namespace canyon::validation {
namespace {

const geodesy::GpsTime kStart = geodesy::GpsTime::from_week(2051, 46701);
const geodesy::Geodetic kPosition = geodesy::Geodetic::from_degrees(22.3, 114.17, 5);

/// Eight minutes at 1 Hz of some 20 satellites of two systems with noise of 3 m.
struct Recording {
  test::CircularSky sky{{gnss::System::GPS, gnss::System::BeiDou}};
  simulation::Trajectory truth = simulation::Trajectory::fixed(kStart, kPosition, 600);
  std::vector<rinex::ObservationEpoch> epochs;
  std::size_t observations = 0;

  Recording() {
    RandomStream random(1, "noise");
    const Eigen::Vector3d antenna = geodesy::ecef_from_geodetic(kPosition);
    for (int s = 0; s < 480; ++s) {
      rinex::ObservationEpoch epoch;
      epoch.receiver_time = kStart + 10.0 + static_cast<double>(s);
      for (const gnss::SatelliteId id : sky.satellites()) {
        const auto line = orbit::line_of_sight(sky, id, epoch.receiver_time, antenna);
        if (!line || line->elevation_rad < 0.1) continue;
        rinex::ObservedSignal signal;
        signal.id = id;
        signal.pseudorange_m =
            line->range_m - geodesy::kSpeedOfLight * (line->state.clock_bias_s - line->state.group_delay_s) +
            3 * random.normal();
        signal.cn0_dbhz = 40;
        epoch.signals.push_back(signal);
        ++observations;
      }
      epochs.push_back(epoch);
    }
  }
};

ResidualOptions vacuum() {
  ResidualOptions options;
  options.ionosphere = options.troposphere = false;
  return options;
}

void residuals(benchmark::State& state) {
  const Recording r;
  for (auto _ : state) {
    benchmark::DoNotOptimize(pseudorange_residuals(r.epochs, r.truth, r.sky, {}, vacuum()));
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * r.observations));
}
BENCHMARK(residuals)->Unit(benchmark::kMillisecond);

void receiver_clock(benchmark::State& state) {
  const Recording r;
  const auto measured = pseudorange_residuals(r.epochs, r.truth, r.sky, {}, vacuum());
  for (auto _ : state) {
    benchmark::DoNotOptimize(remove_receiver_clock(
        measured, [](const PseudorangeResidual& o, const ResidualEpoch&) { return o.id.number % 3 != 0; }));
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * r.observations));
}
BENCHMARK(receiver_clock)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace canyon::validation

BENCHMARK_MAIN();
