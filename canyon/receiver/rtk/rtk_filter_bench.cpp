// Time of one epoch of RTK: 30 satellites, two bands, a base 1 km away.
#include "canyon/receiver/rtk/rtk_filter.hpp"

#include <benchmark/benchmark.h>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"

namespace canyon::rtk {
namespace {

using gnss::System;

const geodesy::GpsTime kTime = geodesy::GpsTime::from_week(2100, 43'200);
const geodesy::Geodetic kRover = geodesy::Geodetic::from_degrees(48, 11, 500);
const geodesy::Geodetic kBase = geodesy::Geodetic::from_degrees(48.009, 11, 505);

const orbit::BroadcastSky& sky() {
  static const orbit::BroadcastSky nominal(orbit::nominal_constellation(
      kTime - 7200.0, kTime + 7200.0, {System::GPS, System::GLONASS, System::Galileo, System::BeiDou}));
  return nominal;
}

/// Measurements without errors, of at most `satellites`.
std::vector<SignalMeasurement> measure(const geodesy::Geodetic& position, geodesy::GpsTime time,
                                       std::size_t satellites, std::size_t bands) {
  const Eigen::Vector3d antenna = geodesy::ecef_from_geodetic(position);
  std::vector<SignalMeasurement> result;
  std::size_t count = 0;
  for (const gnss::SatelliteId id : sky().satellites()) {
    const auto line = orbit::line_of_sight(sky(), id, time, antenna);
    if (!line || line->elevation_rad < geodesy::radians(10) || count++ >= satellites) continue;
    std::size_t taken = 0;
    for (const gnss::Signal& signal : gnss::signals_of(id.system)) {
      if (taken++ >= bands) break;
      SignalMeasurement m{&signal, {}};
      m.measurement.id = id;
      m.measurement.carrier_frequency_hz = gnss::carrier_hz(signal, line->state.carrier_frequency_hz);
      m.measurement.cn0_dbhz = 45;
      const double metres = line->range_m - geodesy::kSpeedOfLight * line->state.clock_bias_s;
      m.measurement.pseudorange_m = metres + geodesy::kSpeedOfLight * line->state.group_delay_of(signal);
      m.measurement.carrier_phase_cycles =
          metres * m.measurement.carrier_frequency_hz / geodesy::kSpeedOfLight;
      m.measurement.phase_since = kTime;
      result.push_back(m);
    }
  }
  return result;
}

/// state.range(0): satellites; state.range(1): signals of each.
void solve_rtk_epoch(benchmark::State& state) {
  const auto satellites = static_cast<std::size_t>(state.range(0)),
             bands = static_cast<std::size_t>(state.range(1));
  positioning::FixOptions masks;
  RtkFilter filter({}, masks, 60);
  std::vector<std::vector<SignalMeasurement>> rover;
  std::vector<Corrections> base;
  for (int k = 0; k < 120; ++k) {
    rover.push_back(measure(kRover, kTime + static_cast<double>(k), satellites, bands));
    Corrections c;
    c.station_ecef = geodesy::ecef_from_geodetic(kBase);
    c.receiver_time = kTime + static_cast<double>(k);
    c.observations = measure(kBase, c.receiver_time, satellites, bands);
    base.push_back(std::move(c));
  }
  positioning::Fix alone;
  alone.status = positioning::FixStatus::Fix;
  alone.position_ecef = geodesy::ecef_from_geodetic(kRover);
  std::size_t k = 0, fixed = 0, epochs = 0;
  for (auto _ : state) {
    if (k == 0) filter = RtkFilter({}, masks, 60);
    filter.take(base[k], sky());
    const auto fix = filter.update(base[k].receiver_time, rover[k], sky(), alone);
    ++epochs;
    if (fix && fix->kind() == positioning::FixKind::Fixed) ++fixed;
    k = (k + 1) % rover.size();
  }
  state.counters["signals"] = static_cast<double>(rover.front().size());
  state.counters["fixed"] = static_cast<double>(fixed) / static_cast<double>(epochs);
}
BENCHMARK(solve_rtk_epoch)
    ->Args({12, 2})
    ->Args({30, 1})
    ->Args({30, 2})
    ->Args({30, 3})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace canyon::rtk

BENCHMARK_MAIN();
