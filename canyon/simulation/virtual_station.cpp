#include "canyon/simulation/virtual_station.hpp"

#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/orbit/sky.hpp"
#include "canyon/positioning/pseudorange_model.hpp"
#include "canyon/simulation/environment.hpp"

namespace canyon::simulation {
namespace {

using geodesy::GpsTime;

/// Parts of a code and a phase at one place [m].
struct Carried {
  double common_m = 0;      ///< range, clocks, orbit, troposphere
  double ionosphere_m = 0;  ///< delay of a code at L1
};

std::optional<Carried> carried(gnss::SatelliteId id, GpsTime time, const Eigen::Vector3d& place,
                               const Environment& environment) {
  const auto line = orbit::line_of_sight(environment.sky(), id, time, place);
  if (!line) return std::nullopt;
  Carried result{positioning::pseudorange_m(*line, 0, 0, 0, 0), 0};
  if (environment.errors()) {
    const errors::SpaceErrors& from = *environment.errors();
    const errors::SpaceDelays space = from.at(*line, from.reception(time, place));
    result.common_m += space.orbit_clock_m + space.troposphere_m;
    result.ionosphere_m = space.ionosphere_m;
  }
  return result;
}

}  // namespace

std::optional<Epoch> VirtualStation::move(const Epoch& base,
                                          const std::optional<Eigen::Vector3d>& reported_ecef) {
  if (!reported_ecef) return std::nullopt;
  const GpsTime time = base.observed.time;
  if (!place_ || (*place_ - *reported_ecef).norm() > kMove_m) {
    place_ = reported_ecef;
    since_ = time;
  }
  Epoch moved = base;
  moved.truth_ecef = *place_;
  moved.truth.position = geodesy::geodetic_from_ecef(*place_);
  for (receiver::SatelliteObservation& satellite : moved.observed.satellites) {
    const auto here = carried(satellite.id, time, base.truth_ecef, *base.environment);
    const auto there = carried(satellite.id, time, *place_, *base.environment);
    const auto move_signal = [&](receiver::SignalObservation& seen) {
      if (!seen.measurement) return;
      if (!here || !there) {
        seen.measurement.reset();
        return;
      }
      positioning::Measurement& m = *seen.measurement;
      const double common_m = there->common_m - here->common_m;
      const double ratio = gnss::kL1_hz / m.carrier_frequency_hz;
      const double ionosphere_m = (there->ionosphere_m - here->ionosphere_m) * ratio * ratio;
      m.pseudorange_m += common_m + ionosphere_m;
      if (m.carrier_phase_cycles) {
        *m.carrier_phase_cycles +=
            (common_m - ionosphere_m) * m.carrier_frequency_hz / geodesy::kSpeedOfLight;
      }
      if (m.phase_since && *m.phase_since < since_) m.phase_since = since_;
    };
    move_signal(satellite);
    for (receiver::SignalObservation& signal : satellite.more) move_signal(signal);
  }
  return moved;
}

}  // namespace canyon::simulation
