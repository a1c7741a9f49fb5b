#include "canyon/calibration/observed.hpp"

#include <algorithm>
#include <cassert>
#include <map>
#include <utility>

#include "canyon/calibration/calibrate.hpp"
#include "canyon/validation/epoch_interval.hpp"

namespace canyon::calibration {
namespace {

Sample sample_of(const validation::ComparedSignal& s, std::size_t epoch,
                 const validation::ComparedSatellite& of) {
  return {epoch,
          of.clear,
          s.measured,
          s.measured_phase.residual_m.has_value(),
          of.elevation_rad,
          s.measured_cn0_dbhz};
}

}  // namespace

Observed observed(const validation::Comparison& comparison) {
  Observed result;
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Series> series;
  for (std::size_t e = 0; e < comparison.epochs.size(); ++e) {
    const validation::ComparedEpoch& epoch = comparison.epochs[e];
    result.times.push_back(epoch.time);
    for (std::size_t i = epoch.first; i < epoch.first + epoch.count; ++i) {
      const validation::ComparedSatellite& satellite = comparison.satellites[i];
      const auto add = [&](const validation::ComparedSignal& signal) {
        Series& of = series[{satellite.id, signal.signal}];
        of.id = satellite.id;
        of.signal = signal.signal;
        of.samples.push_back(sample_of(signal, e, satellite));
      };
      add(satellite);
      for (const validation::ComparedSignal& signal : satellite.more) add(signal);
    }
  }
  result.interval_s = validation::interval_of(result.times);
  for (auto& [key, of] : series) result.series.push_back(std::move(of));
  return result;
}

validation::Recording part_of(const validation::Recording& recording, std::size_t first, std::size_t count) {
  const validation::PseudorangeResiduals& all = recording.residuals;
  assert(count > 0 && first + count <= all.epochs.size());
  validation::Recording part;
  part.antenna_above_terrain_m = recording.antenna_above_terrain_m;
  part.ionosphere = recording.ionosphere;
  part.troposphere = recording.troposphere;
  const auto copy = [](const auto& from, std::size_t begin, std::size_t n, auto& to) {
    to.assign(from.begin() + static_cast<std::ptrdiff_t>(begin),
              from.begin() + static_cast<std::ptrdiff_t>(begin + n));
  };
  copy(recording.places, first, count, part.places);
  copy(recording.measurements, first, count, part.measurements);
  validation::PseudorangeResiduals& residuals = part.residuals;
  copy(all.epochs, first, count, residuals.epochs);
  const validation::ResidualEpoch begin = residuals.epochs.front(), last = residuals.epochs.back();
  copy(all.observations, begin.first, last.first + last.count - begin.first, residuals.observations);
  copy(all.further, begin.first_further, last.first_further + last.further - begin.first_further,
       residuals.further);
  for (validation::ResidualEpoch& epoch : residuals.epochs) {
    epoch.first -= begin.first;
    epoch.first_further -= begin.first_further;
  }
  for (validation::PseudorangeResidual& o : residuals.observations) o.epoch -= first;
  for (validation::PseudorangeResidual& o : residuals.further) o.epoch -= first;
  for (const validation::Recording::OwnFix& fix : recording.own_fixes) {
    if (fix.time >= begin.reception && fix.time <= last.reception) part.own_fixes.push_back(fix);
  }
  return part;
}

}  // namespace canyon::calibration
