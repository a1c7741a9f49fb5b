#include "canyon/run/correction_links.hpp"

#include <tbb/parallel_for.h>
#include <algorithm>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/receiver/corrections.hpp"
#include "canyon/receiver/positioning/range_terms.hpp"
#include "canyon/run/environment.hpp"
#include "canyon/run/scenario/scenario.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::simulation {

CorrectionLinks::CorrectionLinks(const std::vector<ReceiverConfig>& receivers, std::uint64_t seed)
    : links_(receivers.size()),
      places_(receivers.size()),
      reported_(receivers.size()),
      virtual_(receivers.size()) {
  for (std::size_t r = 0; r < receivers.size(); ++r) {
    check_corrections(receivers, r);
    base_.push_back(index_of_base(receivers, receivers[r]));
    fixed_.push_back(receivers[r].fixed.has_value());
    if (receivers[r].options.corrections.virtual_station) virtual_[r].emplace();
    if (base_.back()) links_[r].emplace(receivers[r].options.corrections, seed, receivers[r].options.name);
  }
  std::vector<bool> placed(receivers.size());
  while (order_.size() < receivers.size()) {
    // No cycle: in each round the first that is left and needs nothing that is left comes.
    for (std::size_t r = 0; r < receivers.size(); ++r) {
      if (placed[r] || (base_[r] && !placed[*base_[r]])) continue;
      placed[r] = true;
      order_.push_back(r);
      break;
    }
  }
}

void CorrectionLinks::make_epochs(std::span<const DueEpoch> due, bool parallel, const Make& make) {
  std::vector<Epoch*> made(due.size());
  std::vector<std::shared_ptr<const relative::Corrections>> came(due.size());
  const auto make_one = [&](std::size_t i) {
    made[i] = &make(i, std::move(came[i]));
    made[i]->receiver = due[i].receiver;
  };
  for (std::size_t begin = 0; begin < due.size();) {
    std::size_t end = begin;
    std::vector<bool> seen(base_.size());
    for (; end < due.size() && (parallel || end == begin); ++end) {
      const std::size_t r = due[end].receiver;
      if (seen[r] || (base_[r] && seen[*base_[r]])) break;
      seen[r] = true;
      came[end] = take(r, due[end].time);
    }
    if (end - begin == 1) {
      make_one(begin);
    } else {
      tbb::parallel_for(begin, end, make_one);
    }
    for (; begin < end; ++begin) send(*made[begin]);
  }
}

void CorrectionLinks::send(const Epoch& epoch) {
  places_[epoch.receiver] = epoch.truth_ecef;
  if (epoch.observed.fix.solved()) reported_[epoch.receiver] = epoch.observed.fix.position_ecef;
  const auto corrections_of = [this](const Epoch& base) {
    return receiver::corrections_of(base.observed,
                                    fixed_[base.receiver] ? std::optional(base.truth_ecef) : std::nullopt);
  };
  std::shared_ptr<const relative::Corrections> corrections;
  for (std::size_t r = 0; r < base_.size(); ++r) {
    if (base_[r] != epoch.receiver) continue;
    std::shared_ptr<const relative::Corrections> sent;
    if (virtual_[r]) {
      // The rover's place of its last epoch, since its epoch follows its base's.
      if (const auto moved = virtual_[r]->move(epoch, reported_[r])) sent = corrections_of(*moved);
    } else {
      if (!corrections) corrections = corrections_of(epoch);
      sent = corrections;
    }
    if (sent) links_[r]->send(epoch.observed.time, std::move(sent), places_[r]);
  }
}

std::shared_ptr<const relative::Corrections> CorrectionLinks::take(std::size_t receiver,
                                                                   geodesy::GpsTime time) {
  return links_[receiver] ? links_[receiver]->take(time) : nullptr;
}

namespace {

using geodesy::GpsTime;

/// A satellite as it stands over a place; empty: below the horizon, or not known.
std::optional<propagation::SatelliteView> view_from(const Environment& environment, gnss::SatelliteId id,
                                                    GpsTime time, const Eigen::Vector3d& place) {
  const auto line = orbit::line_of_sight(environment.sky(), id, time, place);
  if (!line) return std::nullopt;
  propagation::SatelliteView view{*line, {}};
  if (const auto& errors = environment.errors()) {
    view.space = errors->at(view.line, errors->reception(time, place));
  }
  return view;
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
    const auto here = view_from(*base.environment, satellite.id, time, base.truth_ecef);
    const auto there = view_from(*base.environment, satellite.id, time, *place_);
    const auto move_signal = [&](receiver::SignalObservation& seen) {
      if (!seen.measurement) return;
      if (!here || !there) {
        seen.measurement.reset();
        return;
      }
      positioning::Measurement& m = *seen.measurement;
      const auto range = [&](const propagation::SatelliteView& view, const geodesy::Geodetic& place) {
        const receiver::RangeState state{base.options, &base.environment->klobuchar(), &view,
                                         seen.signal,  m.carrier_frequency_hz,         time,
                                         place};
        receiver::CodeAndCarrier of_place = range_of(receiver::RangeTermOf::Satellite, state);
        return of_place += range_of(receiver::RangeTermOf::Space, state);
      };
      const receiver::CodeAndCarrier from = range(*here, base.truth.position),
                                     to = range(*there, moved.truth.position);
      m.pseudorange_m += to.code - from.code;
      if (m.carrier_phase_cycles) {
        *m.carrier_phase_cycles +=
            (to.carrier - from.carrier) * m.carrier_frequency_hz / geodesy::kSpeedOfLight;
      }
      if (m.phase_since && *m.phase_since < since_) m.phase_since = since_;
    };
    move_signal(satellite);
    for (receiver::SignalObservation& signal : satellite.more) move_signal(signal);
  }
  return moved;
}

}  // namespace canyon::simulation
