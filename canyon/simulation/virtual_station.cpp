#include "canyon/simulation/virtual_station.hpp"

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/receiver/positioning/range_terms.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::simulation {
namespace {

using geodesy::GpsTime;

/// A satellite in view from a position; empty: below the horizon, or not known.
std::optional<propagation::SatelliteView> view_from(const Environment& environment, gnss::SatelliteId id,
                                                    GpsTime time, const Eigen::Vector3d& point) {
  const auto line = orbit::line_of_sight(environment.sky(), id, time, point);
  if (!line) return std::nullopt;
  propagation::SatelliteView view{*line, {}};
  if (const auto& errors = environment.errors())
    view.space = errors->at(view.line, errors->reception(time, point));
  return view;
}

}  // namespace

std::optional<Epoch> VirtualStation::move(const Epoch& base,
                                          const std::optional<Eigen::Vector3d>& reported_ecef) {
  if (!reported_ecef) return std::nullopt;
  const GpsTime time = base.observed.time;
  if (!position_ || (*position_ - *reported_ecef).norm() > kMove_m) {
    position_ = reported_ecef;
    since_ = time;
  }
  Epoch moved = base;
  moved.truth_ecef = *position_;
  moved.truth.position = geodesy::geodetic_from_ecef(*position_);
  for (receiver::SatelliteObservation& satellite : moved.observed.satellites) {
    const auto here = view_from(*base.environment, satellite.id, time, base.truth_ecef);
    const auto there = view_from(*base.environment, satellite.id, time, *position_);
    const auto move_signal = [&](receiver::SignalObservation& seen) {
      if (!seen.measurement) return;
      if (!here || !there) {
        seen.measurement.reset();
        return;
      }
      positioning::Measurement& m = *seen.measurement;
      const auto range = [&](const propagation::SatelliteView& view, const geodesy::Geodetic& geodetic) {
        const receiver::RangeState state{base.options, &base.environment->klobuchar(), &view,
                                         seen.signal,  m.carrier_frequency_hz,         time,
                                         geodetic};
        receiver::CodeAndCarrier position_range = range_of(receiver::RangeTermOf::Satellite, state);
        return position_range += range_of(receiver::RangeTermOf::Space, state);
      };
      const receiver::CodeAndCarrier from = range(*here, base.truth.position),
                                     to = range(*there, moved.truth.position);
      m.pseudorange_m += to.code - from.code;
      if (m.carrier_phase_cycles)
        *m.carrier_phase_cycles +=
            (to.carrier - from.carrier) * m.carrier_frequency_hz / geodesy::kSpeedOfLight;
      if (m.phase_since && *m.phase_since < since_) m.phase_since = since_;
    };
    move_signal(satellite);
    for (receiver::SignalObservation& signal : satellite.more) move_signal(signal);
  }
  return moved;
}

}  // namespace canyon::simulation
