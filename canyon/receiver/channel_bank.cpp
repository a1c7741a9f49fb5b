#include "canyon/receiver/channel_bank.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/receiver/positioning/pseudorange_model.hpp"
#include "canyon/sky/space_errors.hpp"

namespace canyon::receiver {

using propagation::Visibility;

namespace {

bool in_line_of_sight(Visibility visibility) {
  return visibility == Visibility::LOS || visibility == Visibility::LOSMultipath;
}

}  // namespace

ChannelBank::ChannelBank(const ReceiverOptions& options, std::uint64_t seed, std::string draws)
    : options_(options), seed_(seed), draws_(std::move(draws)) {
  for (const gnss::System system : gnss::kAllSystems) {
    tracks_[static_cast<std::size_t>(system)] = receiver::tracked_signals(options.tracks, system);
  }
  if (options.signal.enabled) signals_.emplace(options.signal, seed, options.name, draws_);
}

void ChannelBank::restart(const disturbance::Restart& restart) {
  known_.emplace(restart, options_.signal.lock, signals_.has_value(), seed_, draws_);
  channels_.clear();
  if (!signals_) return;
  tracking::SignalOptions searching = options_.signal;
  searching.lock.warm_start = false;
  signals_.emplace(std::move(searching), seed_, options_.name, draws_);
}

std::span<const tracking::ReceivedWave> ChannelBank::receive(
    std::span<const propagation::Interference> waves) {
  if (signals_) signals_->receive(waves, received_waves_);
  return received_waves_;
}

std::vector<BandState> ChannelBank::bands(std::span<const tracking::ReceivedWave> waves) {
  std::vector<BandState> result;
  if (!signals_) return result;
  for (const auto& of_system : tracks_) {
    for (const gnss::Signal* signal : of_system) {
      const auto load = signals_->front_end_load(*signal, waves);
      auto found = std::find_if(result.begin(), result.end(),
                                [&](const BandState& band) { return band.carrier_hz == signal->carrier_hz; });
      if (found == result.end()) found = result.insert(found, BandState{signal->carrier_hz, 0, 0});
      if (load.interference > found->interference_ratio) {
        found->interference_ratio = load.interference;
        found->tone_ratio = load.tones;
      }
    }
  }
  std::sort(result.begin(), result.end(),
            [](const BandState& a, const BandState& b) { return a.carrier_hz < b.carrier_hz; });
  return result;
}

tracking::Channel& ChannelBank::channel_of(const tracking::AntennaMotion& motion, gnss::SatelliteId id,
                                           const gnss::Signal& signal) {
  std::vector<tracking::Channel>& of_satellite = channels_[id];
  const auto found = std::find_if(of_satellite.begin(), of_satellite.end(),
                                  [&](const tracking::Channel& c) { return &c.signal() == &signal; });
  if (found != of_satellite.end()) return *found;
  of_satellite.reserve(tracks_[static_cast<std::size_t>(signal.system)].size());  // pointers stay
  tracking::Channel& channel = of_satellite.emplace_back(*signals_, id, signal, motion);
  if (known_) channel.search_for(known_->search_s(id));
  return channel;
}

/// Passes one signal through its channel where signals have a strength; empty where they have none. Sets
/// the observation's lock, C/N0 and excess. @param received by a receiver that hears everything
std::optional<Tracked> ChannelBank::track(const tracking::AntennaMotion& motion,
                                          const propagation::SatelliteView& view, bool free, bool received,
                                          SignalObservation& observation) {
  if (!view.paths.paths.empty()) observation.tracked_path = view.paths.paths.front().kind;
  if (!signals_) {
    observation.direct = in_line_of_sight(view.paths.visibility);
    if (received) {
      observation.lock = tracking::LockState::Tracking;
      observation.excess_m = view.paths.tracked_excess_m();
    }
    return std::nullopt;
  }
  tracking::Channel& channel = channel_of(motion, view.line.id, *observation.signal);
  Tracked tracked{&channel, {}};
  tracked.reception = free ? channel.receive(*signals_, motion, view) : channel.miss(motion.time);
  observation.lock = tracked.reception.lock;
  observation.cn0_dbhz = tracked.reception.cn0_dbhz;
  if (free && !view.paths.paths.empty()) {
    observation.tracked_path = view.paths.paths[tracked.reception.tracked].kind;
    observation.direct = observation.tracked_path == propagation::PathKind::Direct &&
                         *tracked.reception.direct_cn0_dbhz >= options_.signal.lock.tracking_threshold_dbhz;
  }
  if (observation.lock == tracking::LockState::Tracking)
    observation.excess_m = tracked.reception.code_delay_m;
  return tracked;
}

/// The visibility of a satellite by the strength of its signals, whether channels have found them or not.
Visibility ChannelBank::visibility_of(const SatelliteObservation& satellite) const {
  if (!signals_) return satellite.map_visibility;
  bool strong = false, direct = false;
  satellite.for_each_signal([&](const SignalObservation& signal) {
    strong = strong || (signal.cn0_dbhz && *signal.cn0_dbhz >= options_.signal.lock.tracking_threshold_dbhz);
    direct = direct || signal.direct;
  });
  if (direct) return satellite.map_visibility;
  return strong ? Visibility::NLOS : Visibility::Blocked;
}

Followed ChannelBank::follow(const tracking::AntennaMotion& motion, const propagation::Arrival& arrival,
                             ReceiverEpoch& epoch) {
  const bool free = arrival.placement == raytrace::Placement::Free;
  Followed followed;
  epoch.satellites.reserve(arrival.views.size());
  followed.satellites.reserve(arrival.views.size());
  followed.channels.reserve(arrival.views.size());
  for (const propagation::SatelliteView& view : arrival.views) {
    signals_to_track(options_, view.line.id, motion.time, wanted_);
    if (wanted_.empty()) continue;
    SatelliteObservation& seen = epoch.satellites.emplace_back();
    seen.id = view.line.id;
    seen.azimuth_rad = view.line.azimuth_rad;
    seen.elevation_rad = view.line.elevation_rad;
    seen.above_mask =
        view.shown_elevation_rad.value_or(view.line.elevation_rad) >= options_.fix.elevation_mask_rad;
    if (free) seen.map_visibility = view.paths.visibility;
    const bool received = seen.map_visibility != Visibility::Blocked;
    if (in_line_of_sight(seen.map_visibility)) {
      seen.obstacles_db = -20 * std::log10(view.paths.paths.front().amplitude_factor);
    }
    followed.satellites.push_back({&view, followed.channels.size()});
    seen.signal = wanted_.front();
    for (std::size_t k = 1; k < wanted_.size(); ++k) seen.more.emplace_back().signal = wanted_[k];
    seen.for_each_signal([&](SignalObservation& signal) {
      followed.channels.push_back(track(motion, view, free, received, signal));
    });
    seen.visibility = visibility_of(seen);
    if (!seen.above_mask) continue;
    ++(seen.lock == tracking::LockState::Tracking ? epoch.visible : epoch.blocked);
    if (in_line_of_sight(seen.visibility)) ++followed.los;
  }
  return followed;
}

void ChannelBank::miss_all_but(const std::vector<SatelliteObservation>& satellites, geodesy::GpsTime now) {
  auto seen = satellites.begin();
  for (auto& [id, of_satellite] : channels_) {
    while (seen != satellites.end() && seen->id < id) ++seen;
    if (seen != satellites.end() && seen->id == id) continue;
    for (tracking::Channel& channel : of_satellite) channel.miss(now);
  }
}

tracking::LoopErrors ChannelBank::sample(const Tracked& tracked, geodesy::GpsTime now) {
  return tracked.channel->sample(*signals_, now, *tracked.reception.cn0_dbhz);
}

bool ChannelBank::read_ephemeris(const SatelliteObservation& satellite, geodesy::GpsTime now) {
  if (!known_) return true;
  const bool readable =
      satellite.lock == tracking::LockState::Tracking &&
      (!satellite.cn0_dbhz || *satellite.cn0_dbhz >= options_.signal.lock.acquisition_threshold_dbhz);
  return known_->read(satellite.id, *satellite.signal, readable, now);
}

MeasurementModel::MeasurementModel(const ReceiverOptions& options, std::uint64_t seed)
    : options_(options),
      seed_(seed),
      noise_sigma_m_(options.stated_noise_m()),
      noise_doppler_sigma_hz_(options.noise.enabled ? options.noise.doppler_sigma_hz : 0) {}

void MeasurementModel::place(Instant& at, const Eigen::Vector3d& antenna_ecef) const {
  at.place = geodesy::geodetic_from_ecef(antenna_ecef);
  if (!options_.ionosphere && !options_.troposphere) return;
  const auto beside = [&](double dt_s) {
    ShiftedAntenna result;
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
                   at.place,
                   at.clock,
                   observation.excess_m,
                   phase != nullptr ? phase->excess_m : 0,
                   observation.noise_m,
                   bias_m(line.id, signal, m.carrier_frequency_hz, at.time),
                   &view.paths.paths[reception != nullptr ? reception->tracked : 0],
                   &at.motion,
                   air ? &at.before : nullptr,
                   air ? &at.after : nullptr};
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

double MeasurementModel::atmosphere_m(const Instant& at, bool ionosphere, bool troposphere,
                                      const orbit::LineOfSight& line, double carrier_hz) {
  return errors::atmosphere_m(ionosphere, troposphere, *at.klobuchar, line.id.system, carrier_hz, at.time,
                              at.place, {line.azimuth_rad, line.elevation_rad});
}

}  // namespace canyon::receiver
