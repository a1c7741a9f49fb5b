#include "canyon/receiver/receiver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/disturbance/direct_shadowing.hpp"
#include "canyon/errors/atmosphere.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/positioning/fusion/dead_reckoning.hpp"
#include "canyon/positioning/pseudorange_model.hpp"
#include "canyon/receiver/corrections.hpp"
#include "canyon/receiver/known_ephemerides.hpp"
#include "canyon/receiver/receiver_draws.hpp"
#include "canyon/receiver/signal_range.hpp"
#include "canyon/receiver/spoofing_check.hpp"
#include "canyon/relative/rtk_filter.hpp"
#include "canyon/tracking/channel.hpp"

namespace canyon::receiver {
namespace {

using geodesy::kSpeedOfLight;
using propagation::Visibility;
using Measurements = std::vector<positioning::Measurement>;

/// Noise of one satellite's pseudorange and Doppler that does not come from its strength.
struct SignalNoise {
  tracking::OuProcess code;
  RandomStream doppler;
  double drifted_mean_m;  ///< added to the mean in drift mode
  geodesy::GpsTime last;
};

/// How far a signal's bias has drifted.
struct Drift {
  tracking::OuProcess process;
  geodesy::GpsTime last;
};

/// A signal's channel after an epoch.
struct Tracked {
  tracking::Channel* channel = nullptr;
  tracking::Reception reception;
};

/// The antenna a time before or after an epoch.
struct Beside {
  double dt_s = 0;
  Eigen::Vector3d antenna_ecef = Eigen::Vector3d::Zero();
  geodesy::Geodetic place;
  Eigen::Matrix3d enu_from_ecef = Eigen::Matrix3d::Identity();
  double zenith_m = 0;  ///< delay in the troposphere
};

/// An epoch's values that all of its satellites share.
struct Instant {
  geodesy::GpsTime time;
  ClockReading clock;
  tracking::AntennaMotion motion;
  geodesy::Geodetic place;
  const std::map<gnss::System, gnss::Klobuchar>* klobuchar = nullptr;
  Beside before, after;  ///< by half a second, where the signals have delays of the atmosphere
};

/// The satellites of an epoch after their channels have received it, in the order of ReceiverEpoch.
struct Followed {
  struct Satellite {
    const propagation::SatelliteView* view;
    std::size_t first_channel;  ///< in `channels`; those of SatelliteObservation::more come next
  };
  std::vector<Satellite> satellites;
  std::vector<std::optional<Tracked>> channels;  ///< empty where signals have no strength
  int los = 0;                                   ///< satellites in line of sight above the mask
};

/// An epoch's measurements as solvers take them.
struct Solvable {
  Measurements codes, corrected;
  std::vector<relative::SignalMeasurement> of_signals;  ///< for the filter of phases alone
};

bool in_line_of_sight(Visibility visibility) {
  return visibility == Visibility::LOS || visibility == Visibility::LOSMultipath;
}

}  // namespace

struct Receiver::State {
  State(ReceiverOptions receiver_options, std::uint64_t stream_seed,
        std::span<const disturbance::Source> sources, const ModelSource& source_of_models)
      : options(std::move(receiver_options)),
        seed(stream_seed),
        draws(draws_of(options)),
        clock(options.clock, RandomStream(seed, draws + "/clock")),
        ranging(options),
        corrections(options.corrections) {
    options.validate();
    const std::string around = disturbance_draws_of(options);
    noise_sigma_m = options.stated_noise_m();
    if (options.noise.enabled) noise_doppler_sigma_hz = options.noise.doppler_sigma_hz;
    for (const gnss::System system : gnss::kAllSystems) {
      tracks[static_cast<std::size_t>(system)] = receiver::tracked_signals(options.tracks, system);
    }
    if (options.signal.enabled) {
      signals.emplace(options.signal, seed, options.name, draws);
      const disturbance::ShadowingOptions& shadowing = options.signal.shadowing;
      if (shadowing.active()) {
        disturbances.push_back(std::make_unique<disturbance::DirectShadowing>(shadowing, seed, around));
      }
    }
    for (const disturbance::Source& source : sources) {
      disturbances.push_back(source.make(seed, around));
      if (!disturbances.back()) {
        throw InputError(
            fmt::format("receiver '{}': disturbance '{}' was not made", options.name, source.name),
            "its Source::make must give one");
      }
    }
    if (source_of_models) models = source_of_models(seed, draws);
    if (models.sigma_m) options.fix.weights.weighting = positioning::Weighting::Sigma;
    if (models.solve) options.filter.enabled = false;
    if (options.filter.enabled) filter.emplace(options.filter, options.fix);
    if (options.rtk.enabled) rtk.emplace(options.rtk, options.fix, options.corrections.max_age_s);
    if (options.spoofing_check.enabled) check.emplace(options.spoofing_check);
  }

  /// The program's weight of a measurement.
  void weigh(positioning::Measurement& measurement, double elevation_rad, geodesy::GpsTime now) const {
    if (!models.sigma_m) return;
    measurement.sigma_m = models.sigma_m(measurement, elevation_rad);
    if (measurement.sigma_m > 0 && std::isfinite(measurement.sigma_m)) return;
    throw error(
        now,
        fmt::format("the weighting gives {} m for {}", measurement.sigma_m, gnss::to_string(measurement.id)),
        "it must give a standard deviation above 0");
  }

  /// The position of an epoch's measurements alone.
  [[nodiscard]] positioning::Fix solve_alone(const ReceiverEpoch& epoch, const Instant& at,
                                             const Measurements& measurements, const orbit::Sky& sky) const {
    if (models.solve) return models.solve(epoch.receiver_time, measurements, sky, options.fix, *at.klobuchar);
    return solve_fix(epoch.receiver_time, measurements, sky, options.fix, *at.klobuchar);
  }

  /// The position of an epoch: of its corrected measurements where they have a solution, else of all.
  [[nodiscard]] positioning::Fix solve(const ReceiverEpoch& epoch, const Instant& at,
                                       const Solvable& measured, const orbit::Sky& sky) {
    const geodesy::GpsTime receiver_time = epoch.receiver_time;
    positioning::Fix fix;
    if (!measured.corrected.empty()) fix = solve_alone(epoch, at, measured.corrected, sky);
    const bool differential = fix.solved();
    if (differential) {
      fix.solution = positioning::FixKind::Differential;
      fix.correction_age_s = corrections.age_s(receiver_time);
      fix.correction_station = corrections.station();
    } else {
      fix = solve_alone(epoch, at, measured.codes, sky);
    }
    const positioning::Fix of_epoch = fix;
    if (filter) {
      fix = filter->update(receiver_time, differential ? measured.corrected : measured.codes, sky, fix,
                           *at.klobuchar);
    }
    if (!rtk) return fix;
    // The filter of phases begins from the best place; the epoch's own velocity is news to it.
    positioning::Fix begin = fix;
    begin.velocity_enu_mps = of_epoch.velocity_enu_mps;
    begin.velocity_covariance_enu = of_epoch.velocity_covariance_enu;
    auto relative = rtk->update(receiver_time, measured.of_signals, sky, begin);
    if (!relative) return fix;
    // Among echoes a float position may be worse than that of codes. Twice the deviation is allowed, so that
    // the two do not take turns.
    constexpr double kWorse = 4;
    const bool better = relative->kind() == positioning::FixKind::Fixed || !fix.measured() ||
                        relative->covariance_enu.trace() < kWorse * fix.covariance_enu.trace();
    if (!relative->baseline->moving_base && better) return *relative;
    fix.baseline = std::move(relative->baseline);
    return fix;
  }

  /// Begins anew where the epoch says so for the first time.
  void restart_as(const std::optional<disturbance::Restart>& restart, tracking::AntennaMotion& motion) {
    if (!restart || (restarted && restarted->at == restart->at)) return;
    restarted = restart;
    known = KnownEphemerides(*restart, options.signal.lock, signals.has_value(), seed, draws);
    channels.clear();
    ranging = Ranging(options);
    corrections = CodeCorrections(options.corrections);
    if (filter) filter.emplace(options.filter, options.fix);
    if (rtk) rtk.emplace(options.rtk, options.fix, options.corrections.max_age_s);
    if (check) check.emplace(options.spoofing_check);
    fusion.reset();
    if (signals) {
      tracking::SignalOptions searching = options.signal;
      searching.lock.warm_start = false;
      signals.emplace(std::move(searching), seed, options.name, draws);
    }
    first_epoch = motion.first_epoch = motion.time;
    motion.epoch_before.reset();
  }

  [[nodiscard]] InputError error(geodesy::GpsTime time, const std::string& problem, const char* cure) const {
    return InputError(
        fmt::format("receiver '{}' at {}: {}", options.name, geodesy::format_gpst(time), problem), cure);
  }

  [[nodiscard]] disturbance::ReceiverEvents disturb(const propagation::Antenna& antenna,
                                                    propagation::Arrival& arrival) {
    disturbance::ReceiverEvents events;
    if (disturbances.empty()) return events;
    for (const auto& disturbance : disturbances) {
      disturbance->apply(antenna, arrival);
      disturbance->happen(antenna, events);
    }
    for (propagation::SatelliteView& view : arrival.views) view.paths.arrange();
    std::sort(arrival.views.begin(), arrival.views.end(),
              [](const auto& a, const auto& b) { return a.line.id < b.line.id; });
    return events;
  }

  /// Moves antenna and clock on to the epoch.
  [[nodiscard]] tracking::AntennaMotion go_to(const propagation::Antenna& antenna) {
    const geodesy::GpsTime time = antenna.time;
    if (!antenna.position_ecef.allFinite()) {
      throw error(time, "the antenna's position is not finite", "check the trajectory");
    }
    if (!antenna.velocity_ecef.allFinite()) {
      throw error(time, "the antenna's velocity is not finite", "check the trajectory");
    }
    if (last) {
      if (time < *last) throw error(time, "time runs backwards", "give epochs in order of time");
      clock.advance(time - *last);
    } else {
      first_epoch = time;
      last_antenna = antenna.position_ecef;
    }
    tracking::AntennaMotion motion;
    motion.time = time;
    motion.first_epoch = first_epoch;
    motion.epoch_before = last;
    motion.step_m = (antenna.position_ecef - last_antenna).norm();
    motion.velocity_ecef = antenna.velocity_ecef;
    last = time;
    last_antenna = antenna.position_ecef;
    return motion;
  }

  /// Goes on to an epoch: disturbs its arrival, sets the clock and the bands of `epoch`.
  [[nodiscard]] Instant begin(const EpochContext& context, ReceiverEpoch& epoch) {
    Instant at;
    at.time = epoch.time = context.antenna.time;
    at.motion = go_to(context.antenna);
    at.motion.ecef_from_enu = context.arrival.ecef_from_enu;
    epoch.events = disturb(context.antenna, context.arrival);
    restart_as(epoch.events.restart, at.motion);
    at.clock = {clock.bias_s() + epoch.events.clock_bias_s, clock.drift() + epoch.events.clock_drift};
    if (signals) signals->receive(context.arrival.interference, received_waves);
    at.motion.interference = received_waves;
    at.place = geodesy::geodetic_from_ecef(context.antenna.position_ecef);
    if (options.ionosphere || options.troposphere) {
      at.before = beside(at.motion, -0.5);
      at.after = beside(at.motion, 0.5);
    }
    at.klobuchar = &context.klobuchar;
    epoch.clock_bias_s = at.clock.bias_s;
    epoch.clock_drift = at.clock.drift;
    epoch.receiver_time = at.time + at.clock.bias_s;
    epoch.bands = bands(at.motion.interference);
    return at;
  }

  /// State of the front end around each tracked carrier.
  [[nodiscard]] std::vector<BandState> bands(std::span<const tracking::ReceivedWave> waves) {
    std::vector<BandState> result;
    if (!signals) return result;
    for (const auto& of_system : tracks) {
      for (const gnss::Signal* signal : of_system) {
        const auto load = signals->front_end_load(*signal, waves);
        auto found = std::find_if(result.begin(), result.end(), [&](const BandState& band) {
          return band.carrier_hz == signal->carrier_hz;
        });
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

  /// The receiver's own delay of a satellite's signal [m].
  double bias_m(gnss::SatelliteId id, const gnss::Signal& signal, double carrier_hz, geodesy::GpsTime now) {
    const double bias_m = fixed_bias_m(options.biases, id, signal, carrier_hz, now);
    if (options.biases.drift_sigma_m == 0) return bias_m;
    auto found = drifts.find(&signal);
    if (found == drifts.end()) {
      found = drifts.emplace(&signal, Drift{bias_drift(options, seed, signal), now}).first;
    }
    const double drift_m = found->second.process.advance(now - found->second.last);
    found->second.last = now;
    return bias_m + drift_m;
  }

  SignalNoise& noise_of(gnss::SatelliteId id, const gnss::Signal& signal, geodesy::GpsTime now) {
    const std::size_t index = gnss::index_of(signal);
    const auto found = noises.find({id, index});
    if (found != noises.end()) return found->second;
    const std::string key = noise_key(options, id, signal);
    const double mean = options.noise.drift_mu_sigma_m * RandomStream(seed, key + "/mean").normal();
    return noises
        .emplace(std::pair(id, index), SignalNoise{pseudorange_noise(options, seed, id, signal),
                                                   RandomStream(seed, key + "/doppler"), mean, now})
        .first->second;
  }

  /// Passes one signal through its channel where signals have a strength; empty where they have none. Sets
  /// the observation's lock, C/N0 and excess. @param received by a receiver that hears everything
  std::optional<Tracked> track(const Instant& at, const propagation::SatelliteView& view, bool free,
                               bool received, SignalObservation& observation) {
    if (!view.paths.paths.empty()) observation.tracked_path = view.paths.paths.front().kind;
    if (!signals) {
      observation.direct = in_line_of_sight(view.paths.visibility);
      if (received) {
        observation.lock = tracking::LockState::Tracking;
        observation.excess_m = view.paths.tracked_excess_m();
      }
      return std::nullopt;
    }
    const gnss::Signal& signal = *observation.signal;
    std::vector<tracking::Channel>& of_satellite = channels[view.line.id];
    auto found = std::find_if(of_satellite.begin(), of_satellite.end(),
                              [&](const tracking::Channel& channel) { return &channel.signal() == &signal; });
    if (found == of_satellite.end()) {
      of_satellite.reserve(tracks[static_cast<std::size_t>(signal.system)].size());  // pointers stay
      of_satellite.emplace_back(*signals, view.line.id, signal, at.motion);
      found = of_satellite.end() - 1;
      if (restarted) found->search_for(known.search_s(view.line.id));
    }
    Tracked tracked{&*found, {}};
    tracked.reception = free ? found->receive(*signals, at.motion, view) : found->miss(at.time);
    observation.lock = tracked.reception.lock;
    observation.cn0_dbhz = tracked.reception.cn0_dbhz;
    if (free && !view.paths.paths.empty()) {
      observation.tracked_path = view.paths.paths[tracked.reception.tracked].kind;
      observation.direct = observation.tracked_path == propagation::PathKind::Direct &&
                           *tracked.reception.direct_cn0_dbhz >= options.signal.lock.tracking_threshold_dbhz;
    }
    if (observation.lock == tracking::LockState::Tracking)
      observation.excess_m = tracked.reception.code_delay_m;
    return tracked;
  }

  /// The visibility of a satellite by the strength of its signals, whether channels have found them or not.
  [[nodiscard]] Visibility visibility_of(const SatelliteObservation& satellite) const {
    if (!signals) return satellite.map_visibility;
    bool strong = false, direct = false;
    satellite.for_each_signal([&](const SignalObservation& signal) {
      strong = strong || (signal.cn0_dbhz && *signal.cn0_dbhz >= options.signal.lock.tracking_threshold_dbhz);
      direct = direct || signal.direct;
    });
    if (direct) return satellite.map_visibility;
    return strong ? Visibility::NLOS : Visibility::Blocked;
  }

  /// Lists the satellites of an arrival in `epoch`, and passes their signals through their channels.
  [[nodiscard]] Followed follow(const Instant& at, const propagation::Arrival& arrival,
                                ReceiverEpoch& epoch) {
    const bool free = arrival.placement == raytrace::Placement::Free;
    Followed followed;
    epoch.satellites.reserve(arrival.views.size());
    followed.satellites.reserve(arrival.views.size());
    followed.channels.reserve(arrival.views.size());
    for (const propagation::SatelliteView& view : arrival.views) {
      signals_to_track(options, view.line.id, at.time, wanted);
      if (wanted.empty()) continue;
      SatelliteObservation& seen = epoch.satellites.emplace_back();
      seen.id = view.line.id;
      seen.azimuth_rad = view.line.azimuth_rad;
      seen.elevation_rad = view.line.elevation_rad;
      seen.above_mask =
          view.shown_elevation_rad.value_or(view.line.elevation_rad) >= options.fix.elevation_mask_rad;
      if (free) seen.map_visibility = view.paths.visibility;
      const bool received = seen.map_visibility != Visibility::Blocked;
      if (in_line_of_sight(seen.map_visibility)) {
        seen.obstacles_db = -20 * std::log10(view.paths.paths.front().amplitude_factor);
      }
      followed.satellites.push_back({&view, followed.channels.size()});
      seen.signal = wanted.front();
      for (std::size_t k = 1; k < wanted.size(); ++k) seen.more.emplace_back().signal = wanted[k];
      seen.for_each_signal([&](SignalObservation& signal) {
        followed.channels.push_back(track(at, view, free, received, signal));
      });
      seen.visibility = visibility_of(seen);
      if (!seen.above_mask) continue;
      ++(seen.lock == tracking::LockState::Tracking ? epoch.visible : epoch.blocked);
      if (in_line_of_sight(seen.visibility)) ++followed.los;
    }
    return followed;
  }

  /// Gives the corrections that came with an epoch to what uses them.
  void take(const EpochContext& context, const orbit::Sky& sky) {
    if (context.corrections == nullptr) return;
    if (!context.corrections->moving) {
      const double apart_m = (context.corrections->station_ecef - context.antenna.position_ecef).norm();
      corrections.take(
          *context.corrections, sky, options.fix, context.klobuchar, options.shared_error_m(),
          apart_m * std::hypot(options.rtk.ionosphere_gradient, options.rtk.troposphere_gradient));
    }
    if (rtk) rtk->take(*context.corrections, sky);
  }

  /// Measures the signals of an epoch's satellites, and makes of them what solvers take.
  [[nodiscard]] Solvable measure(const Instant& at, const Followed& followed, ReceiverEpoch& epoch) {
    const bool drifting = options.noise.drifts(at.motion.velocity_ecef.norm(), followed.los);
    const bool modelled =
        options.fix.correct_ionosphere && options.ranging.combination == Combination::Uncombined;
    const CodeCorrections* usable = corrections.age_s(epoch.receiver_time) ? &corrections : nullptr;
    if (usable != nullptr) epoch.station_offset_m = usable->station_offset_m();
    Solvable result;
    result.codes.reserve(followed.satellites.size());
    for (std::size_t i = 0; i < followed.satellites.size(); ++i) {
      SatelliteObservation& satellite = epoch.satellites[i];
      const propagation::SatelliteView& view = *followed.satellites[i].view;
      std::size_t channel = followed.satellites[i].first_channel;
      satellite.for_each_signal([&](SignalObservation& signal) {
        const std::optional<Tracked>& tracked = followed.channels[channel++];
        if (!satellite.above_mask || signal.lock != tracking::LockState::Tracking) return;
        signal.measurement = measure(at, view, tracked ? &*tracked : nullptr, drifting, signal);
      });
      const double model_m = atmosphere_m(at, modelled, false, view.line, gnss::kL1_hz);
      const bool readable =
          satellite.lock == tracking::LockState::Tracking &&
          (!satellite.cn0_dbhz || *satellite.cn0_dbhz >= options.signal.lock.acquisition_threshold_dbhz);
      const bool has_ephemeris = known.read(satellite.id, *satellite.signal, readable, at.time);
      const auto ranged = ranging.next(satellite, view.line.state, at.time, model_m, usable);
      if (!has_ephemeris) continue;
      if (rtk) {
        satellite.for_each_signal([&](const SignalObservation& signal) {
          if (signal.measurement) result.of_signals.push_back({signal.signal, *signal.measurement});
        });
      }
      if (!ranged) continue;
      result.codes.push_back(ranged->measurement);
      weigh(result.codes.back(), satellite.elevation_rad, at.time);
      satellite.estimated_ionosphere_m = ranged->ionosphere_m;
      if (!ranged->corrected) continue;
      result.corrected.push_back(*ranged->corrected);
      weigh(result.corrected.back(), satellite.elevation_rad, at.time);
    }
    return result;
  }

  /// Tells the channels of satellites that are below the horizon. `satellites` ascending.
  void miss_all_but(const std::vector<SatelliteObservation>& satellites, geodesy::GpsTime now) {
    auto seen = satellites.begin();
    for (auto& [id, of_satellite] : channels) {
      while (seen != satellites.end() && seen->id < id) ++seen;
      if (seen != satellites.end() && seen->id == id) continue;
      for (tracking::Channel& channel : of_satellite) channel.miss(now);
    }
  }

  /// One signal's measurement. @param tracked null where signals have no strength
  [[nodiscard]] positioning::Measurement measure(const Instant& at, const propagation::SatelliteView& view,
                                                 const Tracked* tracked, bool drifting,
                                                 SignalObservation& observation) {
    const orbit::LineOfSight& line = view.line;
    const gnss::Signal& signal = *observation.signal;
    positioning::Measurement m;
    m.id = line.id;
    m.carrier_frequency_hz = gnss::carrier_hz(signal, line.state.carrier_frequency_hz);

    double doppler_noise_hz = 0;
    if (options.noise.enabled) {
      SignalNoise& noise = noise_of(line.id, signal, at.time);
      const double mean = options.noise.ou.mu_m + (drifting ? noise.drifted_mean_m : 0);
      observation.noise_m = noise.code.advance(at.time - noise.last, mean);
      noise.last = at.time;
      doppler_noise_hz = options.noise.doppler_sigma_hz * noise.doppler.normal();
    }
    tracking::LoopErrors loops;
    if (tracked != nullptr) {
      loops = tracked->channel->sample(*signals, at.time, *tracked->reception.cn0_dbhz);
      m.cn0_dbhz = loops.stated_cn0_dbhz;
      observation.noise_m += loops.code_m;
      observation.code_rate_per_s = loops.code_rate_per_s;
      doppler_noise_hz += loops.doppler_hz;
    }
    // Where there is no noise to state, covariances are per metre and per 0.1 Hz of it.
    m.sigma_m = std::hypot(noise_sigma_m, loops.code_sigma_m);
    if (m.sigma_m == 0) m.sigma_m = 1;
    m.doppler_sigma_hz = std::hypot(noise_doppler_sigma_hz, loops.doppler_sigma_hz);
    if (m.doppler_sigma_hz == 0) m.doppler_sigma_hz = 0.1;

    RangeTerms terms;
    terms.delays = delays_in_signal(options, *at.klobuchar, view, m.carrier_frequency_hz, at.time, at.place);
    terms.code_excess_m = observation.excess_m;
    terms.code_noise_m = observation.noise_m;
    terms.bias_m = observation.bias_m = bias_m(line.id, signal, m.carrier_frequency_hz, at.time);
    const tracking::TrackedPhase* phase =
        tracked != nullptr && tracked->reception.phase ? &*tracked->reception.phase : nullptr;
    if (phase != nullptr) terms.carrier_excess_m = phase->excess_m;
    const SignalRange range = signal_range(view, signal, m.carrier_frequency_hz, at.clock, terms);

    observation.ionosphere_m = terms.delays.ionosphere_m;
    observation.troposphere_m = terms.delays.troposphere_m;
    observation.orbit_error_m = terms.delays.orbit_error_m;
    const double atmosphere = observation.ionosphere_m + observation.troposphere_m;
    const double corrected = atmosphere_m(at, options.fix.correct_ionosphere, options.fix.correct_troposphere,
                                          line, m.carrier_frequency_hz);
    observation.pseudorange_error_m =
        observation.excess_m + observation.noise_m + observation.orbit_error_m + (atmosphere - corrected);
    m.pseudorange_m = range.code_m;

    assert(!view.paths.paths.empty());
    const propagation::Path& path = view.paths.paths[tracked != nullptr ? tracked->reception.tracked : 0];
    const double cycles_per_m = m.carrier_frequency_hz / kSpeedOfLight;
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

  [[nodiscard]] double atmosphere_m(const Instant& at, bool ionosphere, bool troposphere,
                                    const orbit::LineOfSight& line, double carrier_hz) const {
    return positioning::atmosphere_m(ionosphere, troposphere, *at.klobuchar, line.id.system, carrier_hz,
                                     at.time, at.place, {line.azimuth_rad, line.elevation_rad});
  }

  [[nodiscard]] Beside beside(const tracking::AntennaMotion& motion, double dt_s) const {
    Beside result;
    result.dt_s = dt_s;
    result.antenna_ecef = last_antenna + motion.velocity_ecef * dt_s;
    result.place = geodesy::geodetic_from_ecef(result.antenna_ecef);
    result.enu_from_ecef = geodesy::enu_from_ecef_rotation(result.place);
    result.zenith_m = errors::saastamoinen_zenith_m(result.place);
    return result;
  }

  /// Rate of the carrier's delay in the atmosphere [m/s], by central differences over a second: the
  /// ionosphere advances a carrier.
  [[nodiscard]] double atmosphere_rate_mps(const Instant& at, const orbit::LineOfSight& line,
                                           double carrier_hz) const {
    if (!options.ionosphere && !options.troposphere) return 0;
    const auto delay_m = [&](const Beside& there) {
      const geodesy::AzimuthElevation look = geodesy::azimuth_elevation_from_enu(
          there.enu_from_ecef *
          (line.position_at_reception_m + line.velocity_at_reception_mps * there.dt_s - there.antenna_ecef));
      return (options.troposphere ? errors::slant_delay_m(there.zenith_m, look.elevation_rad) : 0) -
             positioning::atmosphere_m(options.ionosphere, false, *at.klobuchar, line.id.system, carrier_hz,
                                       at.time + there.dt_s, there.place, look);
    };
    return delay_m(at.after) - delay_m(at.before);
  }

  [[nodiscard]] ReceiverEpoch observe(const EpochContext& context) {
    ReceiverEpoch epoch;
    const Instant at = begin(context, epoch);
    const orbit::Sky& sky = context.arrival.broadcast ? *context.arrival.broadcast : context.sky;
    const Followed followed = follow(at, context.arrival, epoch);
    take(context, sky);
    const Solvable measured = measure(at, followed, epoch);
    std::sort(epoch.satellites.begin(), epoch.satellites.end(),
              [](const SatelliteObservation& a, const SatelliteObservation& b) { return a.id < b.id; });
    miss_all_but(epoch.satellites, at.time);
    if (context.arrival.placement == raytrace::Placement::Free) {
      epoch.fix = solve(epoch, at, measured, sky);
      for (SatelliteObservation& satellite : epoch.satellites) {
        satellite.used = std::binary_search(epoch.fix.used.begin(), epoch.fix.used.end(), satellite.id);
      }
    } else {
      epoch.fix.status = positioning::FixStatus::NoSignal;
    }
    if (check) epoch.spoofing = check->update(epoch);
    fuse(context, epoch);
    return epoch;
  }

  /// Puts the vehicle's sensors into the fix.
  void fuse(const EpochContext& context, ReceiverEpoch& epoch) {
    if (!options.dead_reckoning.enabled || context.sensors == nullptr) return;
    if (!fusion) fusion.emplace(options.dead_reckoning, context.sensors->mounting);
    epoch.fix = fusion->update(epoch.time, context.sensors->readings, epoch.fix);
    for (SatelliteObservation& satellite : epoch.satellites) {
      satellite.used = std::binary_search(epoch.fix.used.begin(), epoch.fix.used.end(), satellite.id);
    }
  }

  ReceiverOptions options;
  std::uint64_t seed;
  std::string draws;  ///< name of its random streams
  tracking::ReceiverClock clock;
  /// Tracked signals of each system, by System.
  std::array<std::vector<const gnss::Signal*>, gnss::kSystemCount> tracks;
  std::map<std::pair<gnss::SatelliteId, std::size_t>, SignalNoise> noises;  // and index_of() its signal
  std::map<const gnss::Signal*, Drift> drifts;  // of biases; signals are gnss::signals_of()'s
  std::vector<std::unique_ptr<disturbance::Disturbance>> disturbances;
  OwnModels models;
  std::optional<tracking::ChannelModel> signals;
  std::map<gnss::SatelliteId, std::vector<tracking::Channel>> channels;
  Ranging ranging;
  CodeCorrections corrections;
  std::optional<positioning::PositionFilter> filter;
  std::optional<relative::RtkFilter> rtk;
  std::optional<SpoofingCheck> check;
  std::optional<positioning::DeadReckoning> fusion;
  geodesy::GpsTime first_epoch;  ///< since the last restart
  std::optional<geodesy::GpsTime> last;
  Eigen::Vector3d last_antenna;
  double noise_sigma_m = 0;
  double noise_doppler_sigma_hz = 0;
  std::optional<disturbance::Restart> restarted;
  KnownEphemerides known;  // since then
  // Kept for their memory.
  std::vector<tracking::ReceivedWave> received_waves;
  std::vector<const gnss::Signal*> wanted;
};

Receiver::Receiver(ReceiverOptions options, std::uint64_t seed,
                   std::span<const disturbance::Source> disturbances, const ModelSource& models)
    : state_(std::make_unique<State>(std::move(options), seed, disturbances, models)) {}
Receiver::~Receiver() = default;
Receiver::Receiver(Receiver&&) noexcept = default;
Receiver& Receiver::operator=(Receiver&&) noexcept = default;

const ReceiverOptions& Receiver::options() const {
  return state_->options;
}

ReceiverEpoch Receiver::observe(const EpochContext& context) {
  return state_->observe(context);
}

}  // namespace canyon::receiver
