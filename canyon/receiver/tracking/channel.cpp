#include "canyon/receiver/tracking/channel.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::tracking {
namespace {

using propagation::Path;
using propagation::PathKind;

constexpr double kAmbiguities = 1e6;  // whole cycles, from - to +

/// Wraps to [-pi, pi].
double wrapped(double angle_rad) {
  return std::remainder(angle_rad, 2 * geodesy::kPi);
}

/// A diffuse cluster as input of the code loop.
SignalPath bundle(double delay_m, std::complex<double> amplitude, std::complex<double> factor,
                  std::complex<double> s_per_s, double loop_bandwidth_hz, double integration_s) {
  const ClusterWeight weights = cluster_weight(s_per_s, loop_bandwidth_hz, integration_s);
  const double rotation = geodesy::kPi * weights.frequency_hz * integration_s;
  const double sinc = rotation > 1e-8 ? std::sin(rotation) / rotation : 1;
  const double present = std::norm(factor);
  const double power = weights.power(present);
  SignalPath path;
  path.delay_m = delay_m;
  if (present > 0) path.amplitude = amplitude * factor * (std::sqrt(std::max(0.0, power / present)) / sinc);
  path.fading_hz = weights.frequency_hz;
  path.diffuse = true;
  return path;
}

/// compute(), cached by spectrum.
template <typename Compute>
double cached_value(SpectrumValues& known, const propagation::Spectrum& spectrum, const Compute& compute) {
  const auto found =
      std::find_if(known.begin(), known.end(), [&](const auto& each) { return each.first == spectrum; });
  if (found != known.end()) return found->second;
  constexpr std::size_t kMax = 256;  // limit for jammers with ever changing frequencies
  if (known.size() >= kMax) known.clear();
  return known.emplace_back(spectrum, compute()).second;
}

/// Name of a signal's random streams: for the one near L1 only the satellite's.
std::string stream_name(gnss::SatelliteId id, const gnss::Signal& signal) {
  return gnss::index_of(signal) == 0 ? gnss::to_string(id)
                                     : fmt::format("{}/{}", gnss::to_string(id), signal.name);
}

}  // namespace

ChannelModel::ChannelModel(SignalOptions options, std::uint64_t seed, std::string receiver,
                           std::string stream_name)
    : options_(std::move(options)),
      seed_(seed),
      receiver_(std::move(receiver)),
      stream_name_(std::move(stream_name)),
      phases_(seed_, stream_name_) {
  options_.validate();
  noise_dbw_per_hz_ = signal::noise_density_dbw_per_hz(options_.link);
  compression_hz_ = std::pow(10, (options_.front_end_compression_dbm - 30 - noise_dbw_per_hz_) / 10);
}

ChannelModel::Kind& ChannelModel::mutable_kind(const gnss::Signal& signal) {
  std::unique_ptr<Kind>& kind = kinds_[static_cast<std::size_t>(signal.system)][gnss::index_of(signal)];
  if (kind == nullptr) {
    try {
      auto tracker = shared_code_tracker(correlation_of(signal, options_), for_signal(options_.dll, signal));
      const double peak = tracker->correlation().value(0);
      kind = std::make_unique<Kind>(Kind{tracker,
                                         peak * peak,
                                         CodeLoopNoise(*tracker),
                                         {},
                                         for_signal(options_.pll, signal),
                                         for_signal(options_.fll, signal)});
    } catch (const InputError& error) {
      throw InputError(fmt::format("receiver '{}', {} {}: {}", receiver_, gnss::name(signal.system),
                                   signal.name, error.problem()),
                       error.hint());
    }
  }
  return *kind;
}

double ChannelModel::offset_db(gnss::SatelliteId id, const gnss::Signal& signal,
                               geodesy::GpsTime time) const {
  double offset_db = gnss::sum_of(options_.offset_db, id, signal, time) + level_db(options_);
  if (options_.installation_sigma_db > 0)
    offset_db += options_.installation_sigma_db * RandomStream(seed_, receiver_ + "/installation").normal();
  if (options_.satellite_sigma_db > 0)
    offset_db += options_.satellite_sigma_db * RandomStream(seed_, gnss::to_string(id) + "/power").normal();
  return offset_db;
}

void ChannelModel::receive(std::span<const propagation::Interference> waves,
                           std::vector<ReceivedWave>& received) const {
  received.clear();
  for (const propagation::Interference& wave : waves) {
    ReceivedWave& after = received.emplace_back(ReceivedWave{wave.spectrum, wave.copy_of, {}});
    for (const signal::Band band : {signal::Band::Lower, signal::Band::Upper}) {
      if (!options_.antenna.receives(band)) continue;
      after.over_noise_hz[static_cast<std::size_t>(band)] =
          std::pow(10, (wave.power_dbw - noise_dbw_per_hz_) / 10) * gain_for(options_.antenna, wave, band);
    }
  }
}

double ChannelModel::gain_under_interference(std::span<const ReceivedWave> waves, signal::Band band) const {
  double sum_hz = 0;
  for (const ReceivedWave& wave : waves)
    if (signal::band_of(wave.spectrum.centre_hz) == band)
      sum_hz += wave.over_noise_hz[static_cast<std::size_t>(band)];
  return small_signal_gain(sum_hz / compression_hz_);
}

double ChannelModel::noise_factor(const gnss::Signal& signal, gnss::SatelliteId id, double carrier_hz,
                                  double received_hz, std::span<const ReceivedWave> waves) {
  if (waves.empty()) return 1;
  const auto band = static_cast<std::size_t>(signal::band_of(signal.carrier_hz));
  Kind& kind = mutable_kind(signal);
  const Correlation& correlation = kind.tracker->correlation();
  double sum = 0;
  for (const ReceivedWave& wave : waves) {
    if (wave.copy_of == id) continue;
    double separation = 0;
    if (wave.spectrum.shape == propagation::Spectrum::Shape::Tone) {
      separation =
          spectral_separation_per_hz(correlation, received_hz, wave.spectrum) *
          line_factor(wave.spectrum.centre_hz - received_hz, signal.line_hz, options_.dll.integration_s);
    } else {
      propagation::Spectrum off = wave.spectrum;
      off.centre_hz -= carrier_hz;
      separation = cached_value(kind.separations, off,
                                [&] { return spectral_separation_per_hz(correlation, 0, off); });
    }
    sum += wave.over_noise_hz[band] * separation;
  }
  const double gain = gain_under_interference(waves, signal::band_of(signal.carrier_hz));
  return (1 + sum / std::sqrt(kind.peak_power)) / (gain * gain);
}

ChannelModel::FrontEndLoad ChannelModel::front_end_load(const gnss::Signal& signal,
                                                        std::span<const ReceivedWave> waves) {
  FrontEndLoad load;
  if (waves.empty()) return load;
  const auto band = static_cast<std::size_t>(signal::band_of(signal.carrier_hz));
  double bandwidth_hz = correlation_of(signal, options_).bandwidth_hz;
  if (std::isinf(bandwidth_hz)) bandwidth_hz = 4 * signal.chip_rate_hz;
  SpectrumValues& fractions = spectra_[&signal];
  for (const ReceivedWave& wave : waves) {
    propagation::Spectrum off = wave.spectrum;
    off.centre_hz -= signal.carrier_hz;
    const double fraction =
        cached_value(fractions, off, [&] { return fraction_within(off, 0, bandwidth_hz); });
    const double ratio = wave.over_noise_hz[band] / bandwidth_hz * fraction;
    load.interference += ratio;
    if (wave.spectrum.shape == propagation::Spectrum::Shape::Tone) load.tones += ratio;
  }
  return load;
}

RandomStream ChannelModel::stream(gnss::SatelliteId id, const gnss::Signal& signal,
                                  std::string_view purpose) const {
  return {seed_, fmt::format("{}/{}/{}", stream_name_, stream_name(id, signal), purpose)};
}

PathFades ChannelModel::fades(gnss::SatelliteId id, const gnss::Signal& signal) const {
  return {stream_name(id, signal), stream(id, signal, "diffuse")};
}

Channel::Channel(ChannelModel& model, gnss::SatelliteId id, const gnss::Signal& signal,
                 const AntennaMotion& motion)
    : id_(id),
      signal_(&signal),
      offset_db_(model.offset_db(id, signal, motion.time)),
      lock_(model.options().lock),
      fades_(model.fades(id, signal)),
      ambiguity_(model.stream(id, signal, "ambiguity")),
      cn0_noise_(model.stream(id, signal, "cn0")),
      code_noise_(model.kind(signal).tracker->options().loop_bandwidth_hz, model.stream(id, signal, "dll")),
      doppler_noise_(model.kind(signal).fll.loop_bandwidth_hz, model.stream(id, signal, "fll")),
      phase_noise_(model.kind(signal).pll.loop_bandwidth_hz, model.stream(id, signal, "pll")) {
  if (motion.epoch_before) {
    lock_.update(motion.first_epoch, std::nullopt);
    lock_.update(*motion.epoch_before, std::nullopt);
  }
}

bool Channel::jumped(const AntennaMotion& motion, const orbit::LineOfSight& line, double chip_m) {
  static const Path direct;
  const double rate = path_rate_mps(line, motion.velocity_ecef, direct, motion.ecef_from_enu);
  bool result = false;
  if (geometry_) {
    const double elapsed = motion.time - geometry_->time;
    const double expected = geometry_->range_m + (geometry_->rate_mps + rate) / 2 * elapsed;
    result = std::abs(line.range_m - expected) > chip_m;
  }
  geometry_ = Geometry{motion.time, line.range_m, rate};
  return result;
}

// A carrier loop neither follows nor switches to a frequency beyond the pull-in range of an FLL, half a cycle
// per integration (Kaplan & Hegarty, 2nd ed. 2006, 5.3).
bool Channel::within_reach(std::size_t path, bool spoofed, double reach_mps) const {
  return !spoofed || !loop_ || !aid_ ||
         std::abs(rates_mps_[path] - geometry_->rate_mps - aid_offset_mps_) <= reach_mps;
}

void Channel::choose_path(const ChannelModel::Kind& kind, const SignalOptions& options,
                          const AntennaMotion& motion, const propagation::SatelliteView& view,
                          double carrier_hz) {
  const std::vector<Path>& paths = view.paths.paths;
  const Correlation& correlation = kind.tracker->correlation();
  const bool spoofed = std::any_of(paths.begin(), paths.end(),
                                   [](const Path& path) { return path.kind == PathKind::Transmitted; });
  const double reach_mps = geodesy::kSpeedOfLight / carrier_hz / (2 * options.fll.integration_s);
  rates_mps_.resize(paths.size());
  for (std::size_t i = 0; i < paths.size(); ++i)
    rates_mps_[i] = path_rate_mps(view.line, motion.velocity_ecef, paths[i], motion.ecef_from_enu);

  // The carrier aids the replica, while it exists.
  if (loop_ && aid_) {
    const auto same = std::find_if(paths.begin(), paths.end(), [this](const Path& path) {
      return path.kind == aid_->kind && path.reflector == aid_->reflector && path.signals == aid_->signals;
    });
    if (same != paths.end() &&
        within_reach(static_cast<std::size_t>(same - paths.begin()), spoofed, reach_mps))
      loop_->delay_m += same->carrier_excess_m() - aid_->carrier_excess_m();
  }

  // The strongest of the paths at the replica's delay. Clusters count by their mean, else the carrier would
  // follow their fading.
  signal::path_amplitudes(view, carrier_hz, options.antenna, options.strength, amplitudes_);
  tracked_ = 0;
  constexpr double kMinHere = 0.03;
  const unsigned signal_bit = 1U << gnss::index_of(*signal_);
  double strongest = -1;
  double strongest_of_all = -1;
  std::size_t uniform = 0;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const Path& path = paths[i];
    if ((path.signals & signal_bit) == 0) amplitudes_[i] = 0;
    const double amplitude = std::sqrt(std::norm(amplitudes_[i]));
    const double near =
        loop_ ? std::abs(correlation.value((loop_->delay_m - path.excess_m) / correlation.chip_m())) : 1;
    // A loop with a code lock ignores a spoofer's code that is far off.
    if (amplitude > strongest_of_all && (path.kind != PathKind::Transmitted || near >= kMinHere)) {
      strongest_of_all = amplitude;
      uniform = i;
    }
    if (!loop_) continue;
    const double here = amplitude * near;
    if (here > strongest && within_reach(i, spoofed, reach_mps)) {
      strongest = here;
      tracked_ = i;
    }
  }
  // Below it the replica conflicts with all paths, and the carrier is that of another one.
  if (strongest < kMinHere * strongest_of_all) tracked_ = uniform;
}

void Channel::fade_paths(const ChannelModel::Kind& kind, const ChannelModel& model,
                         const AntennaMotion& motion, const propagation::SatelliteView& view,
                         double carrier_hz) {
  const std::vector<Path>& paths = view.paths.paths;
  const double wavelength = geodesy::kSpeedOfLight / carrier_hz;
  const double rotation_rate = view.direction_rate_radps();
  const double elapsed = motion.epoch_before ? motion.time - *motion.epoch_before : 0;
  const double coherence_m = kCoherenceWavelengths * wavelength;
  const double loop_bandwidth_hz = kind.tracker->options().loop_bandwidth_hz * bandwidth_ratio_;
  paths_.resize(paths.size());
  fades_.next_epoch();
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const Path& path = paths[i];
    const double drift_mps = rates_mps_[i] - rates_mps_[tracked_];
    const double fading_hz = fading_rate_hz(drift_mps, wavelength);
    if (path.kind != PathKind::Diffuse) {
      paths_[i] = {path.excess_m, amplitudes_[i], fading_hz, drift_mps + path.code_ahead_mps};
      // An edge's wave keeps its phase relative to the direct one: together they are the field at the
      // boundary of a shadow, which a random phase would destroy.
      if (path.kind == PathKind::Reflected || path.kind == PathKind::Transmitted)
        paths_[i].amplitude *= fades_.fixed(model.phases(), path.reflector);
      continue;
    }
    // The satellite's motion changes a cluster's detours like an antenna motion of excess times its angle.
    const double swept = path.excess_m * rotation_rate;
    const std::complex<double> factor =
        fades_.rayleigh(path.reflector, (motion.step_m + swept * elapsed) / coherence_m);
    const std::complex<double> s((motion.velocity_ecef.norm() + swept) / coherence_m,
                                 -2 * geodesy::kPi * fading_hz);
    paths_[i] = bundle(path.excess_m, amplitudes_[i], factor, s, loop_bandwidth_hz,
                       model.options().dll.integration_s);
    paths_[i].drift_mps = drift_mps;
  }
}

std::optional<CodeLock> Channel::follow_code(const AntennaMotion& motion, const ChannelModel::Kind& kind,
                                             double clear_cn0_dbhz) {
  const double elapsed = motion.epoch_before ? motion.time - *motion.epoch_before : 0;
  if (!loop_) return kind.tracker->lock(paths_);
  const auto code = kind.tracker->follow(*loop_, paths_, elapsed, cn0_hz(clear_cn0_dbhz) / kind.peak_power,
                                         bandwidth_ratio_);
  // The sign of the next peak is opposite: half a cycle.
  if (loop_->jumped) phase_.reset();
  return code;
}

std::optional<TrackedPhase> Channel::follow_phase(const AntennaMotion& motion, const Path& path,
                                                  std::complex<double> prompt, double wavelength_m) {
  const geodesy::GpsTime lock_since = *lock_.tracking_since();
  const double excess_m = path.carrier_excess_m();
  const double rotated = wrapped(std::arg(prompt) + 2 * geodesy::kPi * excess_m / wavelength_m);
  if (phase_ && phase_->kind == path.kind && phase_->reflector == path.reflector &&
      phase_->lock_since == lock_since) {
    phase_->rotated_rad += wrapped(rotated - phase_->rotated_rad);
  } else {
    Phase fresh;
    fresh.kind = path.kind;
    fresh.reflector = path.reflector;
    fresh.lock_since = lock_since;
    fresh.rotated_rad = rotated;
    fresh.tracked.ambiguity = std::floor((2 * ambiguity_.uniform() - 1) * kAmbiguities);
    // The lock's instant if it is new, else this epoch is the first with the phase.
    fresh.tracked.since =
        motion.epoch_before && lock_since <= *motion.epoch_before ? motion.time : lock_since;
    phase_ = fresh;
  }
  phase_->tracked.excess_m = excess_m - phase_->rotated_rad / (2 * geodesy::kPi) * wavelength_m;
  return phase_->tracked;
}

Reception Channel::receive_nothing(geodesy::GpsTime time) {
  Reception result;
  result.lock = lock_.update(time, std::nullopt);
  // At the instant of the previous call the lock still exists, but there is no measurement.
  if (result.lock == LockState::Tracking) result.lock = LockState::Holding;
  if (result.lock == LockState::Searching) {
    loop_.reset();
    bandwidth_ratio_ = 1;
  }
  phase_.reset();
  geometry_.reset();
  fades_.clear();
  return result;
}

Reception Channel::receive(ChannelModel& model, const AntennaMotion& motion,
                           const propagation::SatelliteView& view) {
  assert(view.line.id == id_);
  if (view.paths.paths.empty()) return receive_nothing(motion.time);
  const SignalOptions& options = model.options();
  const ChannelModel::Kind& kind = model.kind(*signal_);
  const double carrier_hz = gnss::carrier_hz(*signal_, view.line.state.carrier_frequency_hz);
  if (jumped(motion, view.line, kind.tracker->correlation().chip_m())) {
    loop_.reset();
    phase_.reset();
    fades_.clear();
  }
  choose_path(kind, model.options(), motion, view, carrier_hz);
  fade_paths(kind, model, motion, view, carrier_hz);

  Reception result;
  result.tracked = tracked_;
  const double received_hz = carrier_hz * (1 - rates_mps_[tracked_] / geodesy::kSpeedOfLight);
  const double noise = model.noise_factor(*signal_, id_, carrier_hz, received_hz, motion.interference);
  const double clear_cn0_dbhz =
      model.clear_cn0_dbhz(*signal_, view.line.elevation_rad, offset_db_) - 10 * std::log10(noise);
  if (view.paths.paths.front().kind == PathKind::Direct)
    result.direct_cn0_dbhz = clear_cn0_dbhz + 10 * std::log10(std::norm(amplitudes_.front()));
  const std::optional<CodeLock> code = follow_code(motion, kind, clear_cn0_dbhz);
  if (code && code->prompt_power > 0) {
    result.cn0_dbhz = clear_cn0_dbhz + 10 * std::log10(code->prompt_power / kind.peak_power);
    result.code_delay_m = code->delay_m;
  }
  result.lock = lock_.update(motion.time, result.cn0_dbhz);
  if (result.lock == LockState::Tracking && !result.cn0_dbhz) result.lock = LockState::Holding;
  if (result.lock == LockState::Searching) {
    loop_.reset();
    bandwidth_ratio_ = 1;
  } else if (result.cn0_dbhz) {
    if (!loop_) loop_ = CodeLoopState{result.code_delay_m};
    bandwidth_ratio_ = kind.noise.bandwidth_ratio(cn0_hz(*result.cn0_dbhz));
  }
  const Path& path = view.paths.paths[tracked_];
  aid_ = path;
  aid_offset_mps_ = rates_mps_[tracked_] - geometry_->rate_mps;
  if (result.lock == LockState::Tracking && result.cn0_dbhz &&
      *result.cn0_dbhz >= options.phase_threshold_dbhz && path.kind != PathKind::Diffuse)
    result.phase = follow_phase(motion, path, code->prompt, geodesy::kSpeedOfLight / carrier_hz);
  else
    phase_.reset();
  return result;
}

LoopErrors Channel::sample(ChannelModel& model, geodesy::GpsTime time, double cn0_dbhz) {
  const SignalOptions& options = model.options();
  LoopErrors errors;
  const double elapsed = sampled_ ? time - *sampled_ : 0, ratio = cn0_hz(cn0_dbhz);
  if (options.loop_noise) {
    const ChannelModel::Kind& kind = model.kind(*signal_);
    const double fraction = kind.noise.bandwidth_ratio(ratio);
    errors.code_sigma_m = kind.noise.sigma_m(ratio);
    errors.code_rate_per_s = 4 * kind.tracker->options().loop_bandwidth_hz * fraction;
    errors.doppler_sigma_hz = fll_jitter_hz(kind.fll, cn0_dbhz);
    errors.phase_sigma_cycles = pll_jitter_rad(kind.pll, cn0_dbhz) / (2 * geodesy::kPi);
    // The noise of a narrower loop is correlated for longer.
    errors.code_m = code_noise_.advance(elapsed * fraction, errors.code_sigma_m);
    errors.doppler_hz = doppler_noise_.advance(elapsed, errors.doppler_sigma_hz);
    errors.phase_cycles = phase_noise_.advance(elapsed, errors.phase_sigma_cycles);
  }
  errors.reported_cn0_dbhz = cn0_dbhz;
  if (options.cn0_averaging_s > 0) {  // after a gap the mean has no memory
    const double fraction = sampled_ ? -std::expm1(-elapsed / options.cn0_averaging_s) : 1;
    mean_cn0_hz_ += fraction * (ratio - mean_cn0_hz_);
    errors.reported_cn0_dbhz = 10 * std::log10(mean_cn0_hz_);
  }
  sampled_ = time;
  if (options.cn0_sigma_db > 0) errors.reported_cn0_dbhz += options.cn0_sigma_db * cn0_noise_.normal();
  if (options.cn0_step_db > 0)
    errors.reported_cn0_dbhz =
        options.cn0_step_db * std::round(errors.reported_cn0_dbhz / options.cn0_step_db);
  return errors;
}

}  // namespace canyon::tracking
