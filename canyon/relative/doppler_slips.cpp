#include "canyon/relative/doppler_slips.hpp"

#include <algorithm>
#include <cmath>

#include "canyon/geodesy/constants.hpp"
#include "canyon/positioning/median.hpp"

namespace canyon::relative {

void DopplerSlips::update(double dt_s, std::span<const ObservedMinusComputed> rover,
                          std::span<const SignalMeasurement> measured) {
  /// A phase and the integral of its Doppler differ by more than this [m] only where the phase slips.
  constexpr double kDopplerParts_m = 1;
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Step> steps;
  std::vector<double> apart;
  for (const SignalMeasurement& seen : measured) {
    const positioning::Measurement& m = seen.measurement;
    if (!m.carrier_phase_cycles || !m.doppler_hz) continue;
    const double wavelength_m = geodesy::kSpeedOfLight / m.carrier_frequency_hz;
    Step step{*m.carrier_phase_cycles * wavelength_m, -*m.doppler_hz * wavelength_m, 0};
    const auto last = last_steps_.find({m.id, seen.signal});
    if (last != last_steps_.end() && dt_s > 0 && dt_s < 2) {
      step.apart_m =
          step.phase_m - last->second.phase_m - dt_s * (step.doppler_mps + last->second.doppler_mps) / 2;
      apart.push_back(step.apart_m);
    }
    steps[{m.id, seen.signal}] = step;
  }
  slipped_.clear();
  if (apart.size() > 4) {
    const double clock_m = positioning::median(apart);
    for (const ObservedMinusComputed& o : rover) {
      const auto step = steps.find({o.id, o.signal});
      if (step == steps.end() || step->second.apart_m == 0) continue;
      if (std::abs(step->second.apart_m - clock_m) > kDopplerParts_m) slipped_.push_back({o.id, o.signal});
    }
  }
  last_steps_ = std::move(steps);
}

bool DopplerSlips::contains(gnss::SatelliteId id, const gnss::Signal* signal) const {
  return std::find(slipped_.begin(), slipped_.end(), std::pair(id, signal)) != slipped_.end();
}

}  // namespace canyon::relative
