// Time of one epoch of weights, RAIM and position filter compared with the plain fix.
#include "canyon/receiver/positioning/position_filter.hpp"

#include <benchmark/benchmark.h>

#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"
#include "tests/support/test_drive.hpp"

namespace canyon::positioning {
namespace {

using gnss::System;

const geodesy::GpsTime kTime = geodesy::GpsTime::from_week(2100, 43'200);
const geodesy::Geodetic kPosition = geodesy::Geodetic::from_degrees(22.3, 114.18, 30);

const orbit::BroadcastSky& sky() {
  static const orbit::BroadcastSky nominal(orbit::nominal_constellation(
      kTime - 7200.0, kTime + 7200.0, {System::GPS, System::GLONASS, System::Galileo, System::BeiDou}));
  return nominal;
}

std::vector<Measurement> measurements(test::TestDrive& drive, std::size_t satellites, int faults) {
  std::vector<Measurement> measured = drive.measure();
  if (measured.size() > satellites) measured.resize(satellites);
  for (int i = 0; i < faults; ++i)
    measured[static_cast<std::size_t>(3 + 5 * i)].pseudorange_m += 100 + 20 * i;
  for (Measurement& m : measured) m.cn0_dbhz = 42;
  return measured;
}

/// state.range(0): Weighting; state.range(1): faulty satellites that RAIM excludes, -1 without RAIM.
void solve_weighted_fix(benchmark::State& state) {
  test::TestDrive drive(sky(), kTime, kPosition, 1);
  const int faults = static_cast<int>(state.range(1));
  const std::vector<Measurement> measured = measurements(drive, 30, faults);
  FixOptions options;
  options.weights.weighting = static_cast<Weighting>(state.range(0));
  options.raim.enabled = faults >= 0;
  Fix fix;
  for (auto _ : state) {
    fix = solve_fix(kTime, measured, sky(), options, {}, drive.position());
    benchmark::DoNotOptimize(fix.position_ecef);
  }
  if (!fix.solved()) state.SkipWithError("no fix");
  state.SetLabel(std::string(name(options.weights.weighting)));
  state.counters["satellites"] = static_cast<double>(fix.used.size());
  state.counters["excluded"] = static_cast<double>(fix.excluded.size());
}
BENCHMARK(solve_weighted_fix)->Args({0, -1})->Args({1, -1})->Args({2, -1})->Args({3, -1});
BENCHMARK(solve_weighted_fix)->Args({0, 0})->Args({0, 1})->Args({0, 3});

/// One epoch of the filter, its fix given; state.range(0): satellites.
void update_position_filter(benchmark::State& state) {
  test::TestDrive drive(sky(), kTime, kPosition, 1);
  const auto satellites = static_cast<std::size_t>(state.range(0));
  FixOptions options;
  const Fix fix = solve_fix(kTime, measurements(drive, satellites, 0), sky(), options);
  PositionFilter filter({}, options);
  std::vector<geodesy::GpsTime> times;
  std::vector<std::vector<Measurement>> epochs;
  for (int i = 0; i < 600; ++i) {
    times.push_back(drive.receiver_time());
    epochs.push_back(measurements(drive, satellites, 0));
    drive.advance(1);
  }
  std::size_t next = 0;
  Fix result;
  for (auto _ : state) {
    if (next == epochs.size()) {
      state.PauseTiming();
      filter = PositionFilter({}, options);
      next = 0;
      state.ResumeTiming();
    }
    result = filter.update(times[next], epochs[next], sky(), fix);
    benchmark::DoNotOptimize(result.position_ecef);
    ++next;
  }
  if (!result.solved()) state.SkipWithError("no answer");
  state.counters["satellites"] = static_cast<double>(result.used.size());
}
BENCHMARK(update_position_filter)->Arg(10)->Arg(30);

}  // namespace
}  // namespace canyon::positioning

BENCHMARK_MAIN();
