#include "canyon/receiver/measurement_model.hpp"

#include <cassert>
#include <cmath>

#include "canyon/errors/atmosphere.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/positioning/pseudorange_model.hpp"
#include "canyon/receiver/signal_range.hpp"

namespace canyon::receiver {

MeasurementModel::MeasurementModel(const ReceiverOptions& options, std::uint64_t seed)
    : options_(options),
      seed_(seed),
      noise_sigma_m_(options.stated_noise_m()),
      noise_doppler_sigma_hz_(options.noise.enabled ? options.noise.doppler_sigma_hz : 0) {}

void MeasurementModel::place(Instant& at, const Eigen::Vector3d& antenna_ecef) const {
  at.place = geodesy::geodetic_from_ecef(antenna_ecef);
  if (!options_.ionosphere && !options_.troposphere) return;
  const auto beside = [&](double dt_s) {
    Beside result;
    result.dt_s = dt_s;
    result.antenna_ecef = antenna_ecef + at.motion.velocity_ecef * dt_s;
    result.place = geodesy::geodetic_from_ecef(result.antenna_ecef);
    result.enu_from_ecef = geodesy::enu_from_ecef_rotation(result.place);
    result.zenith_m = errors::saastamoinen_zenith_m(result.place);
    return result;
  };
  at.before = beside(-0.5);
  at.after = beside(0.5);
}

/// The receiver's own delay of a satellite's signal [m].
double MeasurementModel::bias_m(gnss::SatelliteId id, const gnss::Signal& signal, double carrier_hz,
                                geodesy::GpsTime now) {
  const double bias_m = fixed_bias_m(options_.biases, id, signal, carrier_hz, now);
  if (options_.biases.drift_sigma_m == 0) return bias_m;
  auto found = drifts_.find(&signal);
  if (found == drifts_.end()) {
    found = drifts_.emplace(&signal, Drift{bias_drift(options_, seed_, signal), now}).first;
  }
  const double drift_m = found->second.process.advance(now - found->second.last);
  found->second.last = now;
  return bias_m + drift_m;
}

MeasurementModel::SignalNoise& MeasurementModel::noise_of(gnss::SatelliteId id, const gnss::Signal& signal,
                                                          geodesy::GpsTime now) {
  const std::size_t index = gnss::index_of(signal);
  const auto found = noises_.find({id, index});
  if (found != noises_.end()) return found->second;
  const std::string key = noise_key(options_, id, signal);
  const double mean = options_.noise.drift_mu_sigma_m * RandomStream(seed_, key + "/mean").normal();
  return noises_
      .emplace(std::pair(id, index), SignalNoise{pseudorange_noise(options_, seed_, id, signal),
                                                 RandomStream(seed_, key + "/doppler"), mean, now})
      .first->second;
}

positioning::Measurement MeasurementModel::measure(const Instant& at, const propagation::SatelliteView& view,
                                                   const tracking::Reception* reception,
                                                   const tracking::LoopErrors& loops, bool drifting,
                                                   SignalObservation& observation) {
  const orbit::LineOfSight& line = view.line;
  const gnss::Signal& signal = *observation.signal;
  positioning::Measurement m;
  m.id = line.id;
  m.carrier_frequency_hz = gnss::carrier_hz(signal, line.state.carrier_frequency_hz);

  double doppler_noise_hz = 0;
  if (options_.noise.enabled) {
    SignalNoise& noise = noise_of(line.id, signal, at.time);
    const double mean = options_.noise.ou.mu_m + (drifting ? noise.drifted_mean_m : 0);
    observation.noise_m = noise.code.advance(at.time - noise.last, mean);
    noise.last = at.time;
    doppler_noise_hz = options_.noise.doppler_sigma_hz * noise.doppler.normal();
  }
  if (reception != nullptr) {
    m.cn0_dbhz = loops.stated_cn0_dbhz;
    observation.noise_m += loops.code_m;
    observation.code_rate_per_s = loops.code_rate_per_s;
    doppler_noise_hz += loops.doppler_hz;
  }
  // Where there is no noise to state, covariances are per metre and per 0.1 Hz of it.
  m.sigma_m = std::hypot(noise_sigma_m_, loops.code_sigma_m);
  if (m.sigma_m == 0) m.sigma_m = 1;
  m.doppler_sigma_hz = std::hypot(noise_doppler_sigma_hz_, loops.doppler_sigma_hz);
  if (m.doppler_sigma_hz == 0) m.doppler_sigma_hz = 0.1;

  RangeTerms terms;
  terms.delays = delays_in_signal(options_, *at.klobuchar, view, m.carrier_frequency_hz, at.time, at.place);
  terms.code_excess_m = observation.excess_m;
  terms.code_noise_m = observation.noise_m;
  terms.bias_m = observation.bias_m = bias_m(line.id, signal, m.carrier_frequency_hz, at.time);
  const tracking::TrackedPhase* phase =
      reception != nullptr && reception->phase ? &*reception->phase : nullptr;
  if (phase != nullptr) terms.carrier_excess_m = phase->excess_m;
  const SignalRange range = signal_range(view, signal, m.carrier_frequency_hz, at.clock, terms);

  observation.ionosphere_m = terms.delays.ionosphere_m;
  observation.troposphere_m = terms.delays.troposphere_m;
  observation.orbit_error_m = terms.delays.orbit_error_m;
  const double atmosphere = observation.ionosphere_m + observation.troposphere_m;
  const double corrected = atmosphere_m(at, options_.fix.correct_ionosphere, options_.fix.correct_troposphere,
                                        line, m.carrier_frequency_hz);
  observation.pseudorange_error_m =
      observation.excess_m + observation.noise_m + observation.orbit_error_m + (atmosphere - corrected);
  m.pseudorange_m = range.code_m;

  assert(!view.paths.paths.empty());
  const propagation::Path& path = view.paths.paths[reception != nullptr ? reception->tracked : 0];
  const double cycles_per_m = m.carrier_frequency_hz / geodesy::kSpeedOfLight;
  const SignalRate rate = signal_rate(view, m.carrier_frequency_hz, path, at.motion, at.clock,
                                      atmosphere_rate_mps(at, line, m.carrier_frequency_hz));
  m.doppler_hz = -cycles_per_m * rate.carrier_mps + doppler_noise_hz;
  if (phase != nullptr) {
    m.carrier_phase_cycles = range.carrier_m * cycles_per_m + phase->ambiguity + loops.phase_cycles;
    m.carrier_phase_sigma_cycles = loops.phase_sigma_cycles;
    m.phase_since = phase->since;
  }
  return m;
}

double MeasurementModel::atmosphere_m(const Instant& at, bool ionosphere, bool troposphere,
                                      const orbit::LineOfSight& line, double carrier_hz) {
  return positioning::atmosphere_m(ionosphere, troposphere, *at.klobuchar, line.id.system, carrier_hz,
                                   at.time, at.place, {line.azimuth_rad, line.elevation_rad});
}

/// Rate of the carrier's delay in the atmosphere [m/s], by central differences over a second: the
/// ionosphere advances a carrier.
double MeasurementModel::atmosphere_rate_mps(const Instant& at, const orbit::LineOfSight& line,
                                             double carrier_hz) const {
  if (!options_.ionosphere && !options_.troposphere) return 0;
  const auto delay_m = [&](const Beside& there) {
    const geodesy::AzimuthElevation look = geodesy::azimuth_elevation_from_enu(
        there.enu_from_ecef *
        (line.position_at_reception_m + line.velocity_at_reception_mps * there.dt_s - there.antenna_ecef));
    return (options_.troposphere ? errors::slant_delay_m(there.zenith_m, look.elevation_rad) : 0) -
           positioning::atmosphere_m(options_.ionosphere, false, *at.klobuchar, line.id.system, carrier_hz,
                                     at.time + there.dt_s, there.place, look);
  };
  return delay_m(at.after) - delay_m(at.before);
}

}  // namespace canyon::receiver
