// Time of one position fix, velocity included, and of one whole epoch of a receiver under an open sky.
#include "canyon/receiver/positioning/fix.hpp"

#include <benchmark/benchmark.h>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"

namespace canyon::receiver {
namespace {

using gnss::System;

const geodesy::GpsTime kTime = geodesy::GpsTime::from_week(2100, 43'200);
const geodesy::LocalFrame kFrame(geodesy::Geodetic::from_degrees(22.3, 114.18, 30));

const orbit::BroadcastSky& sky() {
  static const orbit::BroadcastSky nominal(orbit::nominal_constellation(
      kTime - 7200.0, kTime + 7200.0, {System::GPS, System::GLONASS, System::Galileo, System::BeiDou}));
  return nominal;
}

std::vector<propagation::SatelliteView> views(std::size_t maximum) {
  std::vector<propagation::SatelliteView> views;
  const Eigen::Vector3d antenna = kFrame.ecef_from_local({0, 0, 0});
  for (const gnss::SatelliteId id : sky().satellites()) {
    const auto line = orbit::line_of_sight(sky(), id, kTime, antenna);
    if (!line || line->elevation_rad < geodesy::radians(5) || views.size() == maximum) continue;
    propagation::SatelliteView view;
    view.line = *line;
    view.paths.visibility = propagation::Visibility::LOS;
    view.paths.paths.emplace_back();
    views.push_back(view);
  }
  return views;
}

ReceiverEpoch epoch(Receiver& receiver, const std::vector<propagation::SatelliteView>& seen) {
  propagation::Arrival arrival{raytrace::Containment::Free, seen, kFrame.ecef_from_local_rotation()};
  return receiver.observe(
      {{kTime, kFrame.ecef_from_local({0, 0, 0}), Eigen::Vector3d::Zero()}, arrival, sky(), {}});
}

ReceiverOptions options() {
  ReceiverOptions options;
  options.fix.elevation_mask_rad = geodesy::radians(5);
  return options;
}

/// state.range(0): largest number of satellites; state.range(1): 1 starts within 100 m, 0 at Earth's centre.
void solve_fix_of_satellites(benchmark::State& state) {
  Receiver receiver(options(), 1);
  const ReceiverEpoch seen = epoch(receiver, views(static_cast<std::size_t>(state.range(0))));
  std::vector<positioning::Measurement> measurements;
  for (const SatelliteObservation& each : seen.satellites) {
    if (each.measurement) measurements.push_back(*each.measurement);
  }
  const Eigen::Vector3d start =
      state.range(1) != 0 ? kFrame.ecef_from_local({60, 60, -40}) : Eigen::Vector3d::Zero();
  positioning::Fix fix;
  for (auto _ : state) {
    fix = solve_fix(seen.receiver_time, measurements, sky(), options().fix, {}, start);
    benchmark::DoNotOptimize(fix.position_ecef);
  }
  if (!fix.solved()) state.SkipWithError("no fix");
  state.counters["satellites"] = static_cast<double>(fix.used.size());
  state.counters["iterations"] = fix.iterations;
}
BENCHMARK(solve_fix_of_satellites)->Args({10, 0})->Args({30, 0})->Args({30, 1})->Args({50, 0});

/// The part of solve_fix that evaluates the sky: two states of each satellite.
void states_of_satellites(benchmark::State& state) {
  const std::vector<propagation::SatelliteView> seen = views(static_cast<std::size_t>(state.range(0)));
  for (auto _ : state) {
    for (const propagation::SatelliteView& view : seen) {
      benchmark::DoNotOptimize(sky().state(view.line.id, view.line.transmit_time));
      benchmark::DoNotOptimize(sky().state(view.line.id, view.line.transmit_time));
    }
  }
  state.counters["satellites"] = static_cast<double>(seen.size());
}
BENCHMARK(states_of_satellites)->Arg(30);

void observe_epoch(benchmark::State& state) {
  const std::vector<propagation::SatelliteView> seen = views(static_cast<std::size_t>(state.range(0)));
  Receiver receiver(options(), 1);
  for (auto _ : state) benchmark::DoNotOptimize(epoch(receiver, seen).fix.iterations);
}
BENCHMARK(observe_epoch)->Arg(30);

}  // namespace
}  // namespace canyon::receiver

BENCHMARK_MAIN();
