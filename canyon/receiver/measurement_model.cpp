#include "canyon/receiver/measurement_model.hpp"

#include <cassert>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/receiver/random_streams.hpp"
#include "canyon/sky/range_errors.hpp"

namespace canyon::receiver {

MeasurementModel::MeasurementModel(const ReceiverOptions& options, std::uint64_t seed)
    : options_(options),
      seed_(seed),
      noise_sigma_m_(options.reported_noise_m()),
      noise_doppler_sigma_hz_(options.noise.enabled ? options.noise.doppler_sigma_hz : 0) {}

void MeasurementModel::set_geometry(EpochState& at, const Eigen::Vector3d& antenna_ecef) const {
  at.position = geodesy::geodetic_from_ecef(antenna_ecef);
  if (!options_.ionosphere && !options_.troposphere) return;
  const auto neighbour = [&](double dt_s) {
    ShiftedAntenna result;
    result.dt_s = dt_s;
    result.antenna_ecef = antenna_ecef + at.motion.velocity_ecef * dt_s;
    result.position = geodesy::geodetic_from_ecef(result.antenna_ecef);
    result.enu_from_ecef = geodesy::enu_from_ecef_rotation(result.position);
    result.zenith_m = sky::saastamoinen_zenith_m(result.position);
    return result;
  };
  at.before = neighbour(-0.5);
  at.after = neighbour(0.5);
}

/// The receiver's own delay of a satellite's signal [m].
double MeasurementModel::bias_m(gnss::SatelliteId id, const gnss::Signal& signal, double carrier_hz,
                                geodesy::GpsTime now) {
  const double bias_m = fixed_bias_m(options_.biases, id, signal, carrier_hz, now);
  if (options_.biases.drift_sigma_m == 0) return bias_m;
  auto found = drifts_.find(&signal);
  if (found == drifts_.end())
    found = drifts_.emplace(&signal, Drift{bias_drift(options_, seed_, signal), now}).first;
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
  const double mean = NoiseOptions::kDriftMuSigma_m * RandomStream(seed_, key + "/mean").normal();
  return noises_
      .emplace(std::pair(id, index), SignalNoise{pseudorange_noise(options_, seed_, id, signal),
                                                 RandomStream(seed_, key + "/doppler"), mean, now})
      .first->second;
}

positioning::Measurement MeasurementModel::measure(const EpochState& at,
                                                   const propagation::SatelliteView& view,
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
    m.cn0_dbhz = loops.reported_cn0_dbhz;
    observation.noise_m += loops.code_m;
    observation.code_rate_per_s = loops.code_rate_per_s;
    doppler_noise_hz += loops.doppler_hz;
  }
  // Without noise, covariances are those of 1 m and of 0.1 Hz.
  m.sigma_m = std::hypot(noise_sigma_m_, loops.code_sigma_m);
  if (m.sigma_m == 0) m.sigma_m = 1;
  m.doppler_sigma_hz = std::hypot(noise_doppler_sigma_hz_, loops.doppler_sigma_hz);
  if (m.doppler_sigma_hz == 0) m.doppler_sigma_hz = 0.1;

  assert(!view.paths.paths.empty());
  const bool air = options_.ionosphere || options_.troposphere;
  const tracking::TrackedPhase* phase =
      reception != nullptr && reception->phase ? &*reception->phase : nullptr;
  RangeState state{&options_,
                   at.klobuchar,
                   &view,
                   &signal,
                   m.carrier_frequency_hz,
                   at.time,
                   at.position,
                   at.clock,
                   observation.excess_m,
                   phase != nullptr ? phase->excess_m : 0,
                   observation.noise_m,
                   bias_m(line.id, signal, m.carrier_frequency_hz, at.time),
                   &view.paths.paths[reception != nullptr ? reception->tracked : 0],
                   &at.motion,
                   air ? &at.before : nullptr,
                   air ? &at.after : nullptr,
                   {air ? at.before.look_angles(line) : geodesy::AzimuthElevation(),
                    air ? at.after.look_angles(line) : geodesy::AzimuthElevation()}};
  const CodeAndCarrier range = signal_range(state, observation.terms_m);
  observation.pseudorange_error_m =
      observation.excess_m + observation.noise_m + uncorrected_m(state, observation.terms_m);
  m.pseudorange_m = range.code;
  const double cycles_per_m = m.carrier_frequency_hz / geodesy::kSpeedOfLight;
  m.doppler_hz = -cycles_per_m * signal_rate(state).carrier + doppler_noise_hz;
  if (phase != nullptr) {
    m.carrier_phase_cycles = range.carrier * cycles_per_m + phase->ambiguity + loops.phase_cycles;
    m.carrier_phase_sigma_cycles = loops.phase_sigma_cycles;
    m.phase_since = phase->since;
  }
  return m;
}

double MeasurementModel::ionosphere_model_m(const EpochState& at, const orbit::LineOfSight& line) const {
  const RangeTerm& ionosphere = range_terms()[static_cast<std::size_t>(RangeTermId::Ionosphere)];
  return ionosphere
      .model_m({&options_.fix,
                at.klobuchar,
                &line.state,
                nullptr,
                line.id,
                gnss::kL1_hz,
                at.time,
                at.position,
                {line.azimuth_rad, line.elevation_rad}})
      .code;
}

}  // namespace canyon::receiver
