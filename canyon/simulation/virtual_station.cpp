#include "canyon/simulation/virtual_station.hpp"

#include <utility>
#include <vector>

#include "canyon/geodesy/constants.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/orbit/sky.hpp"
#include "canyon/positioning/pseudorange_model.hpp"

namespace canyon::simulation {
namespace {

/// What is in a code and a phase at one place [m].
struct Carried {
  double common_m = 0;      ///< range, clocks, orbit, troposphere
  double ionosphere_m = 0;  ///< of a code at L1
};

std::optional<Carried> carried(gnss::SatelliteId id, geodesy::GpsTime time, const Eigen::Vector3d& place,
                               const Environment& environment) {
  const auto line = orbit::line_of_sight(environment.sky(), id, time, place);
  if (!line) return std::nullopt;
  Carried result{positioning::pseudorange_m(*line, 0, 0, 0, 0), 0};
  if (environment.errors()) {
    const errors::SpaceDelays space = environment.errors()->at(*line, time, place);
    result.common_m += space.orbit_clock_m + space.troposphere_m;
    result.ionosphere_m = space.ionosphere_m;
  }
  return result;
}

}  // namespace

std::shared_ptr<const relative::Corrections> VirtualStation::corrections(
    const std::shared_ptr<const relative::Corrections>& base, geodesy::GpsTime time,
    const Eigen::Vector3d& base_ecef, const std::optional<Eigen::Vector3d>& reported_ecef,
    const Environment& environment) {
  if (!base || !reported_ecef) return nullptr;
  if (!place_ || (*place_ - *reported_ecef).norm() > kMove_m) {
    place_ = reported_ecef;
    since_ = time;
  }
  relative::Corrections moved = *base;
  moved.station_ecef += *place_ - base_ecef;
  moved.observations.clear();
  std::optional<gnss::SatelliteId> satellite;  // of `here` and `there`; its signals stand together
  std::optional<Carried> here, there;
  for (relative::SignalMeasurement seen : base->observations) {
    positioning::Measurement& m = seen.measurement;
    if (satellite != m.id) {
      satellite = m.id;
      here = carried(m.id, time, base_ecef, environment);
      there = carried(m.id, time, *place_, environment);
    }
    if (!here || !there) continue;
    const double common_m = there->common_m - here->common_m;
    const double ratio = gnss::kL1_hz / m.carrier_frequency_hz;
    const double ionosphere_m = (there->ionosphere_m - here->ionosphere_m) * ratio * ratio;
    m.pseudorange_m += common_m + ionosphere_m;
    if (m.carrier_phase_cycles) {
      *m.carrier_phase_cycles += (common_m - ionosphere_m) * m.carrier_frequency_hz / geodesy::kSpeedOfLight;
    }
    if (m.phase_since && *m.phase_since < since_) m.phase_since = since_;
    moved.observations.push_back(seen);
  }
  if (moved.observations.empty()) return nullptr;
  return std::make_shared<const relative::Corrections>(std::move(moved));
}

}  // namespace canyon::simulation
