#include "canyon/receiver/receiver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/paths/disturbance/shadowing.hpp"
#include "canyon/receiver/channel_bank.hpp"
#include "canyon/receiver/measurement_model.hpp"
#include "canyon/receiver/position_solver.hpp"
#include "canyon/receiver/random_streams.hpp"
#include "canyon/receiver/spoofing_check.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::receiver {

struct Receiver::State {
  State(ReceiverOptions receiver_options, std::uint64_t stream_seed,
        std::span<const disturbance::DisturbanceSource> sources, const ModelSource& source_of_models)
      : options(validated(std::move(receiver_options))),
        seed(stream_seed),
        random_stream(stream_name(options)),
        models(source_of_models ? source_of_models(seed, random_stream) : UserModels()),
        clock(options.clock, RandomStream(seed, random_stream + "/clock")),
        fix_noise(seed, random_stream + "/fix noise"),
        channels(options, seed, random_stream),
        measuring(options, seed),
        fix_input(options),
        solver(options, models) {
    const std::string around = disturbance_stream_name(options);
    const disturbance::ShadowingOptions& shadowing = options.signal.shadowing;
    if (options.signal.enabled && shadowing.active())
      disturbances.push_back(std::make_unique<disturbance::DirectShadowing>(shadowing, seed, around));
    for (const disturbance::DisturbanceSource& source : sources) {
      disturbances.push_back(source.make(seed, around));
      if (!disturbances.back()) {
        throw InputError(fmt::format("receiver '{}': disturbance '{}' is null", options.name, source.name),
                         "return a disturbance from its DisturbanceSource::make");
      }
    }
    if (options.spoofing_check.enabled) check.emplace(options.spoofing_check);
  }

  [[nodiscard]] static ReceiverOptions validated(ReceiverOptions options) {
    options.validate();
    return options;
  }

  /// Applies the user model's weight to a measurement.
  void weigh(positioning::Measurement& measurement, double elevation_rad, geodesy::GpsTime now) const {
    if (!models.sigma_m) return;
    measurement.sigma_m = models.sigma_m(measurement, elevation_rad);
    if (measurement.sigma_m > 0 && std::isfinite(measurement.sigma_m)) return;
    throw error(now,
                fmt::format("the weighting returns {} m for {}", measurement.sigma_m,
                            gnss::to_string(measurement.id)),
                "return a standard deviation above 0");
  }

  /// Restarts at the first epoch with this restart.
  void restart_as(const std::optional<disturbance::Restart>& restart, tracking::AntennaMotion& motion) {
    if (!restart || (restarted && restarted->at == restart->at)) return;
    restarted = restart;
    channels.restart(*restart);
    fix_input = FixInput(options);
    solver.restart();
    if (check) check.emplace(options.spoofing_check);
    fusion.reset();
    first_epoch = motion.first_epoch = motion.time;
    motion.epoch_before.reset();
  }

  [[nodiscard]] InputError error(geodesy::GpsTime time, const std::string& problem, const char* hint) const {
    return InputError(
        fmt::format("receiver '{}' at {}: {}", options.name, geodesy::format_gpst(time), problem), hint);
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

  /// Propagates antenna and clock to the epoch.
  [[nodiscard]] tracking::AntennaMotion go_to(const propagation::Antenna& antenna) {
    const geodesy::GpsTime time = antenna.time;
    if (!antenna.position_ecef.allFinite())
      throw error(time, "the antenna's position is not finite", "check the trajectory");
    if (!antenna.velocity_ecef.allFinite())
      throw error(time, "the antenna's velocity is not finite", "check the trajectory");
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

  /// Starts an epoch: disturbs its arrival, sets the clock and the bands of `epoch`.
  [[nodiscard]] EpochState begin(const EpochContext& context, ReceiverEpoch& epoch) {
    EpochState at;
    at.time = epoch.time = context.antenna.time;
    at.motion = go_to(context.antenna);
    at.motion.ecef_from_enu = context.arrival.ecef_from_enu;
    epoch.events = disturb(context.antenna, context.arrival);
    restart_as(epoch.events.restart, at.motion);
    at.clock = {clock.bias_s() + epoch.events.clock_bias_s, clock.drift() + epoch.events.clock_drift};
    at.motion.interference = channels.receive(context.arrival.interference);
    measuring.set_geometry(at, context.antenna.position_ecef);
    at.klobuchar = &context.klobuchar;
    epoch.clock_bias_s = at.clock.bias_s;
    epoch.clock_drift = at.clock.drift;
    epoch.receiver_time = at.time + at.clock.bias_s;
    epoch.bands = channels.bands(at.motion.interference);
    return at;
  }

  /// Measures the signals of an epoch's satellites, and prepares the input of solvers.
  [[nodiscard]] SolverInput measure(const EpochState& at, const TrackingResult& followed,
                                    ReceiverEpoch& epoch) {
    const bool drifting = options.noise.drifts(at.motion.velocity_ecef.norm(), followed.los);
    const bool modelled = options.fix_input.combination == Combination::Uncombined;
    const CodeCorrections* usable = solver.corrections(epoch.receiver_time);
    if (usable != nullptr) epoch.station_offset_m = usable->station_offset_m();
    SolverInput result;
    result.codes.reserve(followed.satellites.size());
    for (std::size_t i = 0; i < followed.satellites.size(); ++i) {
      SatelliteObservation& satellite = epoch.satellites[i];
      const propagation::SatelliteView& view = *followed.satellites[i].view;
      std::size_t channel = followed.satellites[i].first_channel;
      satellite.for_each_signal([&](SignalObservation& signal) {
        const std::optional<TrackedChannel>& tracked = followed.channels[channel++];
        if (!satellite.above_mask || signal.lock != tracking::LockState::Tracking) return;
        const tracking::LoopErrors loops =
            tracked ? channels.sample(*tracked, at.time) : tracking::LoopErrors();
        signal.measurement =
            measuring.measure(at, view, tracked ? &tracked->reception : nullptr, loops, drifting, signal);
      });
      const double model_m = modelled ? measuring.ionosphere_model_m(at, view.line) : 0;
      const bool has_ephemeris = channels.read_ephemeris(satellite, at.time);
      const auto ranged = fix_input.next(satellite, view.line.state, at.time, model_m, usable);
      if (!has_ephemeris) continue;
      if (solver.uses_phases()) {
        satellite.for_each_signal([&](const SignalObservation& signal) {
          if (signal.measurement) result.signal_entries.push_back({signal.signal, *signal.measurement});
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

  [[nodiscard]] ReceiverEpoch observe(const EpochContext& context) {
    ReceiverEpoch epoch;
    const EpochState at = begin(context, epoch);
    const orbit::Sky& sky = context.arrival.broadcast ? *context.arrival.broadcast : context.sky;
    const TrackingResult followed = channels.follow(at.motion, context.arrival, epoch);
    solver.take(context, sky);
    const SolverInput measured = measure(at, followed, epoch);
    std::sort(epoch.satellites.begin(), epoch.satellites.end(),
              [](const SatelliteObservation& a, const SatelliteObservation& b) { return a.id < b.id; });
    channels.drop_channels_except(epoch.satellites, at.time);
    if (context.arrival.containment == raytrace::Containment::Free)
      epoch.fix = solver.solve(epoch.receiver_time, measured, sky, context.klobuchar);
    else
      epoch.fix = solver.without_signal();
    epoch.single_epoch = solver.epoch_fix();
    if (check) epoch.spoofing = check->update(epoch);
    fuse(context, epoch);
    if (!positioning::is_sound(epoch.fix)) refuse(epoch.fix);
    if (epoch.fix.solved() && options.fix_noise.any()) add_noise(epoch.fix);
    epoch.update_used();
    return epoch;
  }

  void fuse(const EpochContext& context, ReceiverEpoch& epoch) {
    if (!options.dead_reckoning.enabled || context.sensors == nullptr) return;
    if (!fusion) fusion.emplace(options.dead_reckoning, context.sensors->mounting);
    epoch.fix = fusion->update(epoch.time, context.sensors->readings, epoch.fix);
  }

  /// Replaces a fix that is not finite by no fix, and restarts its filters.
  void refuse(positioning::Fix& fix) {
    positioning::Fix none;
    none.status = positioning::FixStatus::NotConverged;
    none.available = fix.available;
    fix = none;
    solver.restart();
    fusion.reset();
  }

  /// Adds FixNoiseOptions' noise.
  void add_noise(positioning::Fix& fix) {
    const FixNoiseOptions& o = options.fix_noise;
    const auto add = [&](const Eigen::Vector3d& sigma, Eigen::Vector3d& enu, Eigen::Matrix3d& covariance) {
      for (Eigen::Index i = 0; i < 3; ++i) enu[i] += sigma[i] * fix_noise.normal();
      covariance.diagonal() += sigma.cwiseAbs2();
    };
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    add({o.horizontal_m, o.horizontal_m, o.vertical_m}, moved, fix.covariance_enu);
    positioning::add_offset(fix, moved);
    if (!fix.velocity_enu_mps || !fix.velocity_covariance_enu) return;
    add({o.horizontal_mps, o.horizontal_mps, o.vertical_mps}, *fix.velocity_enu_mps,
        *fix.velocity_covariance_enu);
  }

  const ReceiverOptions options;
  const std::uint64_t seed;
  const std::string random_stream;  ///< name of its random streams
  const UserModels models;
  std::vector<std::unique_ptr<disturbance::Disturbance>> disturbances;
  tracking::ReceiverClock clock;
  RandomStream fix_noise;
  ChannelBank channels;
  MeasurementModel measuring;
  FixInput fix_input;
  PositionSolver solver;
  std::optional<SpoofingCheck> check;
  std::optional<positioning::DeadReckoning> fusion;
  geodesy::GpsTime first_epoch;  ///< since the last restart
  std::optional<geodesy::GpsTime> last;
  Eigen::Vector3d last_antenna;
  std::optional<disturbance::Restart> restarted;
};

Receiver::Receiver(ReceiverOptions options, std::uint64_t seed,
                   std::span<const disturbance::DisturbanceSource> disturbances, const ModelSource& models)
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
