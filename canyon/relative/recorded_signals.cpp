#include "canyon/relative/recorded_signals.hpp"

#include <algorithm>

#include "canyon/gnss/signals.hpp"

namespace canyon::relative {

std::vector<SignalMeasurement> RecordedSignals::next(const rinex::ObservationEpoch& epoch) {
  constexpr unsigned kLostLock = 1, kHalfCycle = 2;
  std::vector<SignalMeasurement> result;
  std::optional<gnss::SatelliteId> last;
  std::optional<double> l1_hz;
  for (const rinex::ObservedSignal& seen : epoch.signals) {
    if (seen.id != last) {
      last = seen.id;
      const auto state = sky_.state(seen.id, epoch.receiver_time);
      l1_hz.reset();
      if (state) l1_hz = state->carrier_frequency_hz;
    }
    const gnss::Signal& signal =
        seen.signal != nullptr ? *seen.signal : gnss::signals_of(seen.id.system).front();
    const auto key = std::pair(seen.id, &signal);
    if (epoch.power_failure || (seen.loss_of_lock & kLostLock) != 0) phases_.erase(key);
    if (!l1_hz || !seen.pseudorange_m) continue;
    SignalMeasurement measured;
    measured.signal = &signal;
    positioning::Measurement& m = measured.measurement;
    m.id = seen.id;
    m.pseudorange_m = *seen.pseudorange_m;
    m.doppler_hz = seen.doppler_hz;
    m.cn0_dbhz = seen.cn0_dbhz;
    m.carrier_frequency_hz = gnss::carrier_hz(signal, *l1_hz);
    if (seen.carrier_phase_cycles) {
      const auto found = phases_.find(key);
      const bool goes_on = found != phases_.end() && before_ && found->second.seen == *before_ &&
                           found->second.code == seen.code;
      Phase& phase = phases_[key];
      if (!goes_on) phase.since = epoch.receiver_time;
      phase.seen = epoch.receiver_time;
      phase.code = seen.code;
      m.carrier_phase_cycles = seen.carrier_phase_cycles;
      m.phase_since = phase.since;
      m.half_cycle = (seen.loss_of_lock & kHalfCycle) != 0;
    }
    align(measured, seen.code.data(), biases_);
    // RINEX 2 has one phase for all codes of a carrier: it counts once.
    const bool again = std::any_of(result.begin(), result.end(), [&](const SignalMeasurement& other) {
      const positioning::Measurement& o = other.measurement;
      return o.id == m.id && other.signal->carrier_hz == signal.carrier_hz &&
             o.carrier_phase_cycles == m.carrier_phase_cycles && o.doppler_hz == m.doppler_hz &&
             o.cn0_dbhz == m.cn0_dbhz;
    });
    if (again) m.carrier_phase_cycles.reset();
    result.push_back(measured);
  }
  before_ = epoch.receiver_time;
  return result;
}

}  // namespace canyon::relative
