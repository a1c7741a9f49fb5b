#include "canyon/output/observations/raw_observations.hpp"

#include <algorithm>

#include "canyon/geodesy/constants.hpp"

namespace canyon::output {

RawEpoch RawObservations::next(const receiver::ReceiverEpoch& seen) {
  constexpr std::int64_t kMillisecond_ns = 1'000'000;
  const bool steered = tags_ == Tags::WholeMilliseconds;
  RawEpoch epoch{steered ? round_to(seen.receiver_time, kMillisecond_ns) : seen.receiver_time, {}};
  // Taken from the exact reading: receiver_time has nanoseconds, which are 0.3 m.
  const double shift_s = steered ? (epoch.tag - seen.time) - seen.clock_bias_s : 0;
  const double drift = steered ? seen.clock_drift : 0;
  for (const receiver::SatelliteObservation& satellite : seen.satellites) {
    const std::size_t first = epoch.observations.size();
    const auto add = [&](const receiver::SignalObservation& observed, const gnss::Signal& signal) {
      if (!observed.measurement) return;
      const positioning::Measurement& m = *observed.measurement;
      RawObservation o;
      o.id = satellite.id;
      o.signal = &signal;
      o.measurement = &m;
      o.pseudorange_m = m.pseudorange_m + geodesy::kSpeedOfLight * shift_s;
      if (m.doppler_hz) o.doppler_hz = *m.doppler_hz * (1 + drift) + m.carrier_frequency_hz * drift;
      if (const auto link = arcs_.next(m, gnss::index_of(signal))) {
        o.carrier_phase_cycles =
            *m.carrier_phase_cycles + link->alignment_cycles + m.carrier_frequency_hz * shift_s;
        o.slip = link->slip;
        geodesy::GpsTime& begun = begun_[{satellite.id, gnss::index_of(signal)}];
        if (link->begins) begun = seen.time;
        o.locked_s = seen.time - begun;
      }
      epoch.observations.push_back(o);
    };
    // Epochs that were made by hand may have no signal: the system's first.
    add(satellite,
        satellite.signal != nullptr ? *satellite.signal : gnss::signals_of(satellite.id.system).front());
    for (const receiver::SignalObservation& other : satellite.more) add(other, *other.signal);
    std::stable_sort(epoch.observations.begin() + static_cast<std::ptrdiff_t>(first),
                     epoch.observations.end(),
                     [](const auto& a, const auto& b) { return a.signal < b.signal; });
  }
  return epoch;
}

int signal_strength_indicator(double cn0_dbhz) {
  return static_cast<int>(std::clamp(cn0_dbhz / 6, 1.0, 9.0));
}

}  // namespace canyon::output
