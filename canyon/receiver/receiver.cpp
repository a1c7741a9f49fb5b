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
#include "canyon/positioning/pseudorange_model.hpp"
#include "canyon/receiver/corrections.hpp"
#include "canyon/receiver/known_ephemerides.hpp"
#include "canyon/receiver/receiver_draws.hpp"
#include "canyon/receiver/signal_delays.hpp"
#include "canyon/receiver/spoofing_check.hpp"
#include "canyon/relative/rtk_filter.hpp"
#include "canyon/tracking/channel.hpp"
#include "canyon/tracking/channel_rate.hpp"

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
    noise_sigma_m = options.slow_error().sigma_m;
    if (options.noise.enabled) {
      if (options.noise.drift_enabled)
        noise_sigma_m = std::hypot(noise_sigma_m, options.noise.drift_mu_sigma_m);
      noise_doppler_sigma_hz = options.noise.doppler_sigma_hz;
    }
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
  void weigh(positioning::Measurement& measurement, double elevation_rad) const {
    if (!models.sigma_m) return;
    measurement.sigma_m = models.sigma_m(measurement, elevation_rad);
    if (measurement.sigma_m > 0 && std::isfinite(measurement.sigma_m)) return;
    throw error(
        fmt::format("the weighting gives {} m for {}", measurement.sigma_m, gnss::to_string(measurement.id)),
        "it must give a standard deviation above 0");
  }

  /// The position of an epoch's measurements alone.
  [[nodiscard]] positioning::Fix solve_alone(geodesy::GpsTime receiver_time, const Measurements& measurements,
                                             const orbit::Sky& sky) const {
    if (models.solve) return models.solve(receiver_time, measurements, sky, options.fix, *klobuchar);
    return solve_fix(receiver_time, measurements, sky, options.fix, *klobuchar);
  }

  /// The position of an epoch: of its corrected measurements where they have a solution, else of all.
  [[nodiscard]] positioning::Fix solve(geodesy::GpsTime receiver_time, const Measurements& measurements,
                                       const Measurements& corrected, const orbit::Sky& sky,
                                       const std::vector<relative::SignalMeasurement>& of_signals) {
    positioning::Fix fix;
    if (!corrected.empty()) fix = solve_alone(receiver_time, corrected, sky);
    const bool differential = fix.solved();
    if (differential) {
      fix.solution = positioning::FixKind::Differential;
      fix.correction_age_s = corrections.age_s(receiver_time);
      fix.correction_station = corrections.station();
    } else {
      fix = solve_alone(receiver_time, measurements, sky);
    }
    const positioning::Fix of_epoch = fix;
    if (filter) {
      fix = filter->update(receiver_time, differential ? corrected : measurements, sky, fix, *klobuchar);
    }
    if (!rtk) return fix;
    // Its place is the best to begin from; the epoch's own velocity is new to the filter of phases.
    positioning::Fix begin = fix;
    begin.velocity_enu_mps = of_epoch.velocity_enu_mps;
    begin.velocity_covariance_enu = of_epoch.velocity_covariance_enu;
    auto relative = rtk->update(receiver_time, of_signals, sky, begin);
    if (!relative) return fix;
    // Among echoes a float position may be worse than that of codes: by twice the deviation, so that the two
    // do not take turns.
    constexpr double kWorse = 4;
    const bool better = relative->kind() == positioning::FixKind::Fixed || !fix.measured() ||
                        relative->covariance_enu.trace() < kWorse * fix.covariance_enu.trace();
    if (!relative->baseline->moving_base && better) return *relative;
    fix.baseline = std::move(relative->baseline);
    return fix;
  }

  /// Begins anew where the epoch says so for the first time.
  void restart_as(const std::optional<disturbance::Restart>& restart) {
    if (!restart || (restarted && restarted->at == restart->at)) return;
    restarted = restart;
    known = KnownEphemerides(*restart, options.signal.lock, signals.has_value(), seed, draws);
    channels.clear();
    ranging = Ranging(options);
    corrections = CodeCorrections(options.corrections);
    if (filter) filter.emplace(options.filter, options.fix);
    if (rtk) rtk.emplace(options.rtk, options.fix, options.corrections.max_age_s);
    if (check) check.emplace(options.spoofing_check);
    if (signals) {
      tracking::SignalOptions searching = options.signal;
      searching.lock.warm_start = false;
      signals.emplace(std::move(searching), seed, options.name, draws);
    }
    motion.first_epoch = now;
    motion.epoch_before.reset();
  }

  [[nodiscard]] InputError error(const std::string& problem, const char* cure) const {
    return InputError(
        fmt::format("receiver '{}' at {}: {}", options.name, geodesy::format_gpst(now), problem), cure);
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

  void go_to(const propagation::Antenna& antenna, const Eigen::Matrix3d& ecef_from_enu) {
    const geodesy::GpsTime time = antenna.time;
    if (last) {
      if (time < *last) throw error("time runs backwards", "give epochs in order of time");
      clock.advance(time - *last);
    } else {
      motion.first_epoch = time;
      last_antenna = antenna.position_ecef;
    }
    motion.time = time;
    motion.epoch_before = last;
    motion.step_m = (antenna.position_ecef - last_antenna).norm();
    motion.velocity_ecef = antenna.velocity_ecef;
    motion.ecef_from_enu = ecef_from_enu;
    last = time;
    last_antenna = antenna.position_ecef;
  }

  /// The front end around each carrier that is tracked of any system.
  [[nodiscard]] std::vector<BandState> bands() {
    std::vector<BandState> result;
    if (!signals) return result;
    for (const auto& of_system : tracks) {
      for (const gnss::Signal* signal : of_system) {
        const auto load = signals->front_end_load(*signal, motion.interference);
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

  /// Of the receiver's way for a satellite's signal now [m].
  double bias_m(gnss::SatelliteId id, const gnss::Signal& signal, double carrier_hz) {
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

  SignalNoise& noise_of(gnss::SatelliteId id, const gnss::Signal& signal) {
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

  /// What arrives of one signal, through its channel where signals have a strength; empty where they have
  /// none. Sets the observation's lock, C/N0 and excess.
  std::optional<Tracked> track(const propagation::SatelliteView& view, bool free, bool received,
                               SignalObservation& observation) {
    if (!signals) {
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
      of_satellite.emplace_back(*signals, view.line.id, signal, motion);
      found = of_satellite.end() - 1;
      if (restarted) found->search_for(known.search_s(view.line.id));
    }
    Tracked tracked{&*found, {}};
    tracked.reception = free ? found->receive(*signals, motion, view) : found->miss(now);
    observation.lock = tracked.reception.lock;
    observation.cn0_dbhz = tracked.reception.cn0_dbhz;
    if (observation.lock == tracking::LockState::Tracking)
      observation.excess_m = tracked.reception.code_delay_m;
    return tracked;
  }

  /// Whether any of its signals could be tracked now: not, whether its channel has found it.
  [[nodiscard]] bool receives(const SatelliteObservation& satellite) const {
    if (!signals) return true;
    const auto strong = [&](const SignalObservation& signal) {
      return signal.cn0_dbhz && *signal.cn0_dbhz >= options.signal.lock.tracking_threshold_dbhz;
    };
    return strong(satellite) || std::any_of(satellite.more.begin(), satellite.more.end(), strong);
  }

  /// Channels of satellites that are below the horizon. `satellites` ascending.
  void miss_all_but(const std::vector<SatelliteObservation>& satellites) {
    auto seen = satellites.begin();
    for (auto& [id, of_satellite] : channels) {
      while (seen != satellites.end() && seen->id < id) ++seen;
      if (seen != satellites.end() && seen->id == id) continue;
      for (tracking::Channel& channel : of_satellite) channel.miss(now);
    }
  }

  positioning::Measurement measure(const propagation::SatelliteView& view, const Tracked* tracked,
                                   bool drifting, SignalObservation& observation) {
    const orbit::LineOfSight& line = view.line;
    const gnss::Signal& signal = *observation.signal;
    positioning::Measurement m;
    m.id = line.id;
    m.carrier_frequency_hz = gnss::carrier_hz(signal, line.state.carrier_frequency_hz);

    double doppler_noise_hz = 0;
    if (options.noise.enabled) {
      SignalNoise& noise = noise_of(line.id, signal);
      const double mean = options.noise.ou.mu_m + (drifting ? noise.drifted_mean_m : 0);
      observation.noise_m = noise.code.advance(now - noise.last, mean);
      noise.last = now;
      doppler_noise_hz = options.noise.doppler_sigma_hz * noise.doppler.normal();
    }
    tracking::LoopErrors loops;
    if (tracked != nullptr) {
      loops = tracked->channel->sample(*signals, now, *tracked->reception.cn0_dbhz);
      m.cn0_dbhz = loops.stated_cn0_dbhz;
      observation.noise_m += loops.code_m;
      doppler_noise_hz += loops.doppler_hz;
    }
    // Where there is no noise to state, covariances are per metre and per 0.1 Hz of it.
    m.sigma_m = std::hypot(noise_sigma_m, loops.code_sigma_m);
    if (m.sigma_m == 0) m.sigma_m = 1;
    m.doppler_sigma_hz = std::hypot(noise_doppler_sigma_hz, loops.doppler_sigma_hz);
    if (m.doppler_sigma_hz == 0) m.doppler_sigma_hz = 0.1;

    const DelaysInSignal delays =
        delays_in_signal(options, *klobuchar, view, m.carrier_frequency_hz, now, place);
    observation.ionosphere_m = delays.ionosphere_m;
    observation.troposphere_m = delays.troposphere_m;
    observation.orbit_error_m = delays.orbit_error_m;
    const double atmosphere = observation.ionosphere_m + observation.troposphere_m;
    const double corrected = atmosphere_m(options.fix.correct_ionosphere, options.fix.correct_troposphere,
                                          line, m.carrier_frequency_hz);
    observation.pseudorange_error_m =
        observation.excess_m + observation.noise_m + observation.orbit_error_m + (atmosphere - corrected);
    m.pseudorange_m =
        positioning::pseudorange_m(line, observation.excess_m, clock_bias_s, atmosphere, observation.noise_m);
    observation.bias_m = bias_m(line.id, signal, m.carrier_frequency_hz);
    m.pseudorange_m += observation.bias_m + observation.orbit_error_m;
    // For the first one this is 0.
    m.pseudorange_m += kSpeedOfLight * (line.state.group_delay_of(signal) - line.state.group_delay_s);

    // -(f/c) dP/dT, T the receiver's clock: dT = (1 + drift) dt.
    assert(!view.paths.paths.empty());
    const propagation::Path& path = view.paths.paths[tracked != nullptr ? tracked->reception.tracked : 0];
    const double rate = tracking::path_rate_mps(line, motion.velocity_ecef, path, motion.ecef_from_enu) +
                        kSpeedOfLight * (clock_drift - line.state.clock_drift) +
                        atmosphere_rate_mps(line, m.carrier_frequency_hz);
    const double cycles_per_rad = gnss::kL1_hz / m.carrier_frequency_hz / (2 * geodesy::kPi);
    m.doppler_hz = -m.carrier_frequency_hz / kSpeedOfLight * rate / (1 + clock_drift) -
                   view.carrier_turn_radps * cycles_per_rad + doppler_noise_hz;
    if (tracked != nullptr && tracked->reception.phase) {
      const tracking::TrackedPhase& phase = *tracked->reception.phase;
      // The ionosphere advances a phase by what it delays a code.
      const double metres = line.range_m + phase.excess_m +
                            kSpeedOfLight * (clock_bias_s - line.state.clock_bias_s) +
                            observation.troposphere_m - observation.ionosphere_m + observation.orbit_error_m;
      m.carrier_phase_cycles = metres * (m.carrier_frequency_hz / kSpeedOfLight) +
                               view.carrier_turn_rad * cycles_per_rad + phase.ambiguity + loops.phase_cycles;
      m.carrier_phase_sigma_cycles = loops.phase_sigma_cycles;
      m.phase_since = phase.since;
    }
    return m;
  }

  [[nodiscard]] double atmosphere_m(bool ionosphere, bool troposphere, const orbit::LineOfSight& line,
                                    double carrier_hz) const {
    return positioning::atmosphere_m(ionosphere, troposphere, *klobuchar, line.id.system, carrier_hz, now,
                                     place, {line.azimuth_rad, line.elevation_rad});
  }

  /// The antenna a time before or after the epoch.
  struct Beside {
    double dt_s = 0;
    Eigen::Vector3d antenna_ecef = Eigen::Vector3d::Zero();
    geodesy::Geodetic place;
    Eigen::Matrix3d enu_from_ecef = Eigen::Matrix3d::Identity();
    double zenith_m = 0;  ///< delay in the troposphere
  };
  [[nodiscard]] Beside beside(double dt_s) const {
    Beside result;
    result.dt_s = dt_s;
    result.antenna_ecef = last_antenna + motion.velocity_ecef * dt_s;
    result.place = geodesy::geodetic_from_ecef(result.antenna_ecef);
    result.enu_from_ecef = geodesy::enu_from_ecef_rotation(result.place);
    result.zenith_m = errors::saastamoinen_zenith_m(result.place);
    return result;
  }

  /// Of the carrier's way through the atmosphere [m/s], by central differences over a second: the ionosphere
  /// advances a carrier.
  [[nodiscard]] double atmosphere_rate_mps(const orbit::LineOfSight& line, double carrier_hz) const {
    if (!options.ionosphere && !options.troposphere) return 0;
    const auto way_m = [&](const Beside& at) {
      const geodesy::AzimuthElevation look = geodesy::azimuth_elevation_from_enu(
          at.enu_from_ecef *
          (line.position_at_reception_m + line.velocity_at_reception_mps * at.dt_s - at.antenna_ecef));
      return (options.troposphere ? errors::slant_delay_m(at.zenith_m, look.elevation_rad) : 0) -
             positioning::atmosphere_m(options.ionosphere, false, *klobuchar, line.id.system, carrier_hz,
                                       now + at.dt_s, at.place, look);
    };
    return way_m(after) - way_m(before);
  }

  ReceiverOptions options;
  std::uint64_t seed;
  std::string draws;  ///< what sets its random draws apart
  tracking::ReceiverClock clock;
  /// Of each system, by System.
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
  std::optional<geodesy::GpsTime> last;
  Eigen::Vector3d last_antenna;
  double noise_sigma_m = 0;
  double noise_doppler_sigma_hz = 0;
  std::optional<disturbance::Restart> restarted;
  KnownEphemerides known;  // since then

  // Of the epoch in hand.
  geodesy::GpsTime now;
  double clock_bias_s = 0, clock_drift = 0;
  std::vector<tracking::ReceivedWave> received_waves;
  tracking::AntennaMotion motion;
  geodesy::Geodetic place;
  Beside before, after;  ///< by half a second, where the signals have delays of the atmosphere
  const std::map<gnss::System, gnss::Klobuchar>* klobuchar = nullptr;
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
  State& state = *state_;
  const ReceiverOptions& options = state.options;
  const propagation::Antenna& antenna = context.antenna;
  const geodesy::GpsTime time = antenna.time;
  state.now = time;
  if (!antenna.position_ecef.allFinite()) {
    throw state.error("the antenna's position is not finite", "check the trajectory");
  }
  if (!antenna.velocity_ecef.allFinite()) {
    throw state.error("the antenna's velocity is not finite", "check the trajectory");
  }
  state.go_to(antenna, context.arrival.ecef_from_enu);
  ReceiverEpoch epoch;
  epoch.events = state.disturb(antenna, context.arrival);
  state.restart_as(epoch.events.restart);
  state.clock_bias_s = state.clock.bias_s() + epoch.events.clock_bias_s;
  state.clock_drift = state.clock.drift() + epoch.events.clock_drift;
  const orbit::Sky& sky = context.arrival.broadcast ? *context.arrival.broadcast : context.sky;
  if (state.signals) state.signals->receive(context.arrival.interference, state.received_waves);
  state.motion.interference = state.received_waves;
  state.place = geodesy::geodetic_from_ecef(antenna.position_ecef);
  if (options.ionosphere || options.troposphere) {
    state.before = state.beside(-0.5);
    state.after = state.beside(0.5);
  }
  state.klobuchar = &context.klobuchar;

  epoch.time = time;
  epoch.clock_bias_s = state.clock_bias_s;
  epoch.clock_drift = state.clock_drift;
  epoch.receiver_time = time + state.clock_bias_s;
  epoch.bands = state.bands();
  const std::vector<propagation::SatelliteView>& views = context.arrival.views;
  epoch.satellites.reserve(views.size());

  const bool free = context.arrival.placement == raytrace::Placement::Free;
  std::vector<std::size_t> view_of;             // of each satellite that is listed
  std::vector<std::optional<Tracked>> tracked;  // of each signal, in their order
  view_of.reserve(views.size());
  tracked.reserve(views.size());
  std::vector<const gnss::Signal*> wanted;
  int los = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const propagation::SatelliteView& view = views[i];
    signals_to_track(options, view.line.id, time, wanted);
    if (wanted.empty()) continue;
    SatelliteObservation observation;
    observation.id = view.line.id;
    observation.azimuth_rad = view.line.azimuth_rad;
    observation.elevation_rad = view.line.elevation_rad;
    observation.above_mask =
        view.shown_elevation_rad.value_or(view.line.elevation_rad) >= options.fix.elevation_mask_rad;
    if (free) observation.visibility = view.paths.visibility;
    const bool received = observation.visibility != Visibility::Blocked;  // by whoever receives everything
    observation.signal = wanted.front();
    tracked.push_back(state.track(view, free, received, observation));
    for (std::size_t k = 1; k < wanted.size(); ++k) {
      observation.more.emplace_back().signal = wanted[k];
      tracked.push_back(state.track(view, free, received, observation.more.back()));
    }
    if (observation.visibility == Visibility::NLOS && !state.receives(observation)) {
      observation.visibility = Visibility::Blocked;
    }
    if (observation.above_mask) {
      ++(observation.lock == tracking::LockState::Tracking ? epoch.visible : epoch.blocked);
      if (in_line_of_sight(observation.visibility)) ++los;
    }
    view_of.push_back(i);
    epoch.satellites.push_back(std::move(observation));
  }

  const bool drifting = options.noise.drifts(antenna.velocity_ecef.norm(), los);
  Measurements measurements, corrected;
  std::vector<relative::SignalMeasurement> of_signals;  // for the filter of phases alone
  measurements.reserve(views.size());
  if (context.corrections != nullptr) {
    if (!context.corrections->moving) {
      const double apart_m = (context.corrections->station_ecef - antenna.position_ecef).norm();
      state.corrections.take(
          *context.corrections, sky, options.fix, context.klobuchar, options.shared_error_m(),
          apart_m * std::hypot(options.rtk.ionosphere_gradient, options.rtk.troposphere_gradient));
    }
    if (state.rtk) state.rtk->take(*context.corrections, sky);
  }
  const CodeCorrections* corrections =
      state.corrections.age_s(epoch.receiver_time) ? &state.corrections : nullptr;
  if (corrections != nullptr) epoch.station_offset_m = corrections->station_offset_m();
  std::size_t next = 0;
  for (std::size_t i = 0; i < view_of.size(); ++i) {
    SatelliteObservation& satellite = epoch.satellites[i];
    const propagation::SatelliteView& view = views[view_of[i]];
    const auto measure = [&](SignalObservation& observation) {
      const std::optional<Tracked>& channel = tracked[next++];
      if (!satellite.above_mask || observation.lock != tracking::LockState::Tracking) return;
      observation.measurement = state.measure(view, channel ? &*channel : nullptr, drifting, observation);
    };
    measure(satellite);
    for (SignalObservation& signal : satellite.more) measure(signal);
    const bool modelled =
        options.fix.correct_ionosphere && options.ranging.combination == Combination::Uncombined;
    const double model_m = state.atmosphere_m(modelled, false, view.line, gnss::kL1_hz);
    const bool readable =
        satellite.lock == tracking::LockState::Tracking &&
        (!satellite.cn0_dbhz || *satellite.cn0_dbhz >= options.signal.lock.acquisition_threshold_dbhz);
    const bool known = state.known.read(satellite.id, *satellite.signal, readable, time);
    const auto ranged = state.ranging.next(satellite, view.line.state, time, model_m, corrections);
    if (state.rtk && known) {
      const auto give = [&](const SignalObservation& signal) {
        if (signal.measurement) of_signals.push_back({signal.signal, *signal.measurement});
      };
      give(satellite);
      for (const SignalObservation& signal : satellite.more) give(signal);
    }
    if (!ranged || !known) continue;
    measurements.push_back(ranged->measurement);
    state.weigh(measurements.back(), satellite.elevation_rad);
    satellite.estimated_ionosphere_m = ranged->ionosphere_m;
    if (!ranged->corrected) continue;
    corrected.push_back(*ranged->corrected);
    state.weigh(corrected.back(), satellite.elevation_rad);
  }
  std::sort(epoch.satellites.begin(), epoch.satellites.end(),
            [](const SatelliteObservation& a, const SatelliteObservation& b) { return a.id < b.id; });
  state.miss_all_but(epoch.satellites);

  if (!free) {
    epoch.fix.status = positioning::FixStatus::NoSignal;
    if (state.check) epoch.spoofing = state.check->update(epoch);
    return epoch;
  }
  epoch.fix = state.solve(epoch.receiver_time, measurements, corrected, sky, of_signals);
  for (SatelliteObservation& observation : epoch.satellites) {
    observation.used = std::binary_search(epoch.fix.used.begin(), epoch.fix.used.end(), observation.id);
  }
  if (state.check) epoch.spoofing = state.check->update(epoch);
  return epoch;
}

}  // namespace canyon::receiver
