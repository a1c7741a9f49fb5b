#include "canyon/simulation/receiver_runner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/paths/disturbance/disturbance.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/receiver/fix_faults.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/motion/antenna_pose.hpp"
#include "canyon/simulation/receiver_surroundings.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/sensor_run.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/simulation/trace_points.hpp"

namespace canyon::simulation {
namespace {

using geodesy::GpsTime;

// Nominal orbits are made for this time span, then made again.
constexpr double kSkySpan_s = 86400;

// Limits of a vehicle's motion, see observe().
constexpr double kSlack_m = 10;
constexpr double kHardest_mps2 = 200;

/// Restarts a receiver hot at an instant that its host sets.
class HotRestart final : public disturbance::Disturbance {
 public:
  /// @param at the latest restart; empty: none so far
  explicit HotRestart(std::shared_ptr<const std::optional<GpsTime>> at) : at_(std::move(at)) {}

  void happen(const propagation::Antenna& /*antenna*/, disturbance::ReceiverEvents& events) override {
    if (!*at_ || (events.restart && events.restart->at >= **at_)) return;
    if (!restart_ || restart_->at != **at_) {
      // A fault's restart at this instant has priority.
      restart_ = events.restart.value_or(disturbance::Restart{**at_, disturbance::RestartKind::Hot});
      restart_->at = **at_;
    }
    events.restart = restart_;
  }

 private:
  std::shared_ptr<const std::optional<GpsTime>> at_;
  std::optional<disturbance::Restart> restart_;
};

std::shared_ptr<CityScene> checked(std::shared_ptr<CityScene> scene) {
  if (!scene) throw InputError("a live receiver needs a scene");
  return scene;
}

}  // namespace

struct ReceiverRunner::Impl {
  Impl(RunnerConfig c, std::shared_ptr<CityScene> s, GpsTime t, bool shared,
       std::shared_ptr<const BuiltSky> given, std::shared_ptr<const disturbance::Road> known)
      : config(std::move(c)),
        scene(checked(std::move(s))),
        start(t),
        sky(shared ? std::move(given) : make_sky(start)),
        sky_begin(start),
        environment(simulation::make_environment(scene, *sky, config.sky, config.seed)),
        whole_road(std::move(known)),
        faults(make_faults()),
        receiver(make_receiver()) {
    if (config.base() != nullptr) {
      throw InputError(
          fmt::format("receiver '{}' has a base, but runs without it", config.receiver().options.name),
          "use simulation::Simulation, which computes the epochs of both");
    }
    warnings = config.warnings;
    const auto own = sky->report.warnings();  // another receiver reports those of a shared one
    if (!shared) warnings.insert(warnings.end(), own.begin(), own.end());
    check(config.receiver());
    sensors = vehicle_sensors(config.sensors, config.receiver());
  }

  /// The receiver's options depend on sky, errors and city. Order of disturbances: its own, the streets along
  /// its route (none for a fixed receiver), its faults.
  [[nodiscard]] receiver::Receiver make_receiver() const {
    const ReceiverConfig& of = config.receiver();
    std::vector<disturbance::DisturbanceSource> sources =
        of.fixed ? of.disturbances : with_streets(of, environment.city(), whole_road ? whole_road : road);
    sources.push_back(disturbance::FaultTimeline::source(faults));
    sources.push_back({"put elsewhere", [at = teleported](std::uint64_t /*seed*/, const std::string&) {
                         return std::make_unique<HotRestart>(at);
                       }});
    receiver::ReceiverOptions options =
        with_surroundings(of, environment.scene(), environment.city(), config.seed);
    decide_options(options, environment.errors().get(), &environment.sky());
    return {std::move(options), config.seed, sources, of.models};
  }
  /// Sets city and sky for the effects of faults around the receiver.
  void surround(disturbance::FaultTimeline& timeline) const {
    timeline.set_surroundings({sky->sky, std::shared_ptr<const city::City>(scene, &scene->city),
                               std::shared_ptr<const raytrace::RayScene>(scene, &scene->scene)});
  }
  [[nodiscard]] std::shared_ptr<disturbance::FaultTimeline> make_faults() const {
    auto made =
        std::make_shared<disturbance::FaultTimeline>(start, config.faults, config.receiver().options.name);
    surround(*made);
    return made;
  }
  /// The host's time of the last step, or of the first one.
  [[nodiscard]] double now_s() const { return std::max(last_s, 0.0); }
  [[nodiscard]] std::shared_ptr<const BuiltSky> make_sky(GpsTime from) const {
    const GpsTime to = config.sky.nominal ? from + kSkySpan_s : from;
    BuiltSky built = build_sky(config.sky, from, to, scene->city.frame.origin());
    built.errors = make_range_errors(config.sky, built, config.seed);
    built.errors_seed = config.seed;
    return std::make_shared<const BuiltSky>(std::move(built));
  }

  void use_sky(std::shared_ptr<const BuiltSky> other, GpsTime from) {
    sky = std::move(other);
    sky_begin = from;
    make_environment();
  }

  void check(const ReceiverConfig& other) const {
    other.options.validate();
    other.propagation.validate();
    other.streets.validate();
    if (other.options.dead_reckoning.enabled && !config.with_sensors) {
      throw InputError(
          fmt::format("receiver '{}' uses dead reckoning but has no vehicle sensor input",
                      other.options.name),
          "run it by canyon simulate or canyon live with sensors: {imu: {}} (hosts have none yet), or set "
          "dead_reckoning: {enabled: false}");
    }
    check_sensors(config.sensors, other);
    if (other.options.ionosphere || other.options.fix.correct_ionosphere) require_ionosphere(*sky);
  }

  /// Measurements, fix and its error at a known position. `arrival` is disturbed in place.
  Epoch make_epoch(const Pose& truth, propagation::Arrival& arrival, const SensorBatch* samples) {
    arrival.messages = {sky, &sky->navigation};
    const auto given = std::exchange(corrections, nullptr);
    if (sensors) sensors->readings = {};
    if (sensors && samples != nullptr) sensors->readings = readings_of(*samples, config.sensors, start);
    const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(truth.position);
    Epoch epoch;
    epoch.truth = truth;
    epoch.truth_ecef = geodesy::ecef_from_geodetic(truth.position);
    epoch.containment = arrival.containment;
    epoch.environment = &environment;
    epoch.options = &receiver.options();
    epoch.sensors = samples;
    epoch.geoid_undulation_m =
        config.city.sea_level.geoid_undulation_m.value_or(environment.city().geoid_undulation_m);
    const propagation::Antenna antenna{truth.time, epoch.truth_ecef,
                                       enu_from_ecef.transpose() * truth.velocity_enu_mps};
    epoch.observed = receiver.observe({antenna, arrival, environment.sky(), environment.klobuchar(),
                                       given.get(), sensors ? &*sensors : nullptr});
    fix_faults.apply(antenna, epoch.observed);
    epoch.navigation = arrival.messages.get();  // disturbances may have replaced them
    epoch.faults = epoch.observed.events.faults;
    if (epoch.observed.fix.solved())
      epoch.error_enu_m = enu_from_ecef * (epoch.observed.fix.position_ecef - epoch.truth_ecef);
    const auto warning = receiver::wrong_station_warning(epoch.observed.station_offset_m);
    if (warning && !std::exchange(warned_of_station, true)) warnings.push_back(*warning);
    return epoch;
  }

  void make_environment() {
    arrivals.reset();
    environment = simulation::make_environment(scene, *sky, config.sky, config.seed);
    surround(*faults);
  }

  /// Starts the step at `t`. @param under_sky the caller's sky is used, and covers `t`
  void go_to(GpsTime t, bool under_sky) {
    const double seconds = t - start;
    if (seconds < last_s) restart();
    if (!under_sky) bring_sky_to(t);
    last_s = seconds;
  }

  /// Whether the host moved the antenna by a jump since the previous step.
  void look_for_jump(const Pose& antenna, const Eigen::Vector3d& enu_m, bool continuous) {
    const double reported_mps = antenna.velocity_enu_mps.norm();
    const auto before =
        std::exchange(last_step, LastStep{antenna.time, enu_m, std::max(reported_mps, kTeleport_mps / 2)});
    if (!before) return;
    const double step_s = antenna.time - before->time;
    const double travelled_m = (enu_m - before->enu_m).norm();
    last_step->speed_mps = step_s > 0 ? std::max(reported_mps, travelled_m / step_s) : before->speed_mps;
    const double reach_m = kSlack_m + 2 * before->speed_mps * step_s +
                           std::min(kHardest_mps2 * step_s / 2, kTeleport_mps) * step_s;
    if (continuous || travelled_m <= reach_m) return;
    *teleported = antenna.time;
    road->clear();
    warnings.push_back(fmt::format(
        "the antenna jumped by {:.0f} m at {:.1f} s: restarting the receiver, as after a hot start",
        travelled_m, antenna.time - start));
  }

  void restart() {
    faults = make_faults();
    reset_state();
  }

  void reset_state() {
    ++started;
    if (arrivals) arrivals->forget();
    road->clear();
    corrections.reset();
    teleported->reset();
    last_step.reset();
    receiver = make_receiver();
    fix_faults = {};
    last_s = -std::numeric_limits<double>::infinity();
    warned_empty = false;
  }

  // Only nominal orbits can be computed for any time.
  void bring_sky_to(GpsTime t) {
    if (!config.sky.nominal) return;
    if (t - sky_begin < 0 || t - sky_begin > kSkySpan_s) use_sky(make_sky(t), t);
  }

  /// The antenna's position at a step.
  struct LastStep {
    GpsTime time;
    Eigen::Vector3d enu_m;
    double speed_mps;
  };

  RunnerConfig config;
  std::shared_ptr<CityScene> scene;
  GpsTime start;
  std::shared_ptr<const BuiltSky> sky;
  GpsTime sky_begin;
  Environment environment;
  std::shared_ptr<disturbance::Road> road = std::make_shared<disturbance::Road>();  // travelled so far
  std::shared_ptr<const disturbance::Road> whole_road;  // the whole; null: unknown
  std::shared_ptr<disturbance::FaultTimeline> faults;
  std::shared_ptr<std::optional<GpsTime>> teleported = std::make_shared<std::optional<GpsTime>>();  // last
  receiver::Receiver receiver;
  receiver::FixFaults fix_faults;
  Tracer tracer;
  std::optional<RetracedAntenna> arrivals;  // created if no tracer replaces it
  std::optional<Pose> last_truth;
  std::optional<LastStep> last_step;
  double last_s = -std::numeric_limits<double>::infinity();
  bool warned_empty = false;
  int started = 0;
  std::vector<std::string> warnings;
  bool warned_of_station = false;
  std::shared_ptr<const rtk::Corrections> corrections;  // that arrived since the last step
  std::optional<receiver::VehicleSensors> sensors;      // of a receiver with dead reckoning
};

ReceiverRunner::ReceiverRunner(RunnerConfig config, std::shared_ptr<CityScene> scene, GpsTime start,
                               std::shared_ptr<const BuiltSky> sky,
                               std::shared_ptr<const disturbance::Road> road)
    : impl_(std::make_unique<Impl>(std::move(config), std::move(scene), start, sky != nullptr, std::move(sky),
                                   std::move(road))) {}
ReceiverRunner::~ReceiverRunner() = default;
ReceiverRunner::ReceiverRunner(ReceiverRunner&&) noexcept = default;

const RunnerConfig& ReceiverRunner::config() const {
  return impl_->config;
}
GpsTime ReceiverRunner::start() const {
  return impl_->start;
}
GpsTime ReceiverRunner::at(double seconds) const {
  if (!std::isfinite(seconds) || std::abs(seconds) > 1e9)
    throw InputError(fmt::format("the host's time {} s is out of range", seconds));
  return impl_->start + seconds;
}
const BuiltSky& ReceiverRunner::sky() const {
  return *impl_->sky;
}
std::shared_ptr<const BuiltSky> ReceiverRunner::shared_sky() const {
  return impl_->sky;
}

void ReceiverRunner::set_scene(std::shared_ptr<CityScene> scene) {
  if (scene == impl_->scene) return;
  impl_->scene = checked(std::move(scene));
  impl_->make_environment();
  if (std::isinf(impl_->last_s)) impl_->receiver = impl_->make_receiver();
}

void ReceiverRunner::set_tracer(Tracer tracer) {
  impl_->tracer = std::move(tracer);
}

void ReceiverRunner::check(const RunnerConfig& config) const {
  impl_->check(config.receiver());
}

void ReceiverRunner::set_config(RunnerConfig config) {
  check(config);
  config.sky = impl_->config.sky;
  config.start = impl_->config.start;
  config.sensors = impl_->config.sensors;
  config.with_sensors = impl_->config.with_sensors;
  impl_->warnings.insert(impl_->warnings.end(), config.warnings.begin(), config.warnings.end());
  config.receivers.resize(1);
  impl_->config = std::move(config);
  impl_->sensors = vehicle_sensors(impl_->config.sensors, impl_->config.receiver());
  impl_->make_environment();
  impl_->reset_state();
}

void ReceiverRunner::set_rate(double rate_hz) {
  impl_->config.rate_hz = rate_hz;
}

std::string ReceiverRunner::add_fault(const std::string& text, const std::string& source) {
  disturbance::Fault fault =
      disturbance::parse_fault(text, source, impl_->now_s(), impl_->faults->next_number());
  if (fault.until_s && *fault.until_s < impl_->now_s()) {
    throw InputError(fmt::format("fault '{}' is already over: it ends at {:g} s, and the time is {:.1f} s",
                                 fault.name, *fault.until_s, impl_->now_s()),
                     "leave from_s out for a fault from now on");
  }
  std::string name = fault.name;
  impl_->faults->add(std::move(fault));
  return name;
}

void ReceiverRunner::end_fault(const std::string& name) {
  impl_->faults->end(name, impl_->now_s());
}

std::vector<disturbance::FaultState> ReceiverRunner::faults() const {
  return impl_->faults->states(impl_->now_s());
}

ReceiverRunner::Step ReceiverRunner::observe(const Pose& antenna, const StepInputs& inputs) {
  Impl& impl = *impl_;
  const GpsTime t = antenna.time;
  const geodesy::LocalFrame& frame = impl.scene->city.frame;
  const Eigen::Vector3d enu = frame.local_from_geodetic(antenna.position);
  raytrace::check_position(enu, "the antenna's position");
  if (!is_possible(antenna, frame)) {
    throw InputError("the antenna's velocity or yaw is not finite, or it is faster than 1000 km/s",
                     "check the source of the vehicle's motion");
  }
  impl.go_to(t, inputs.arrival != nullptr);
  impl.look_for_jump(antenna, enu, inputs.continuous);
  if (impl.config.receiver().streets.enabled && !impl.whole_road) {
    impl.road->face({std::cos(antenna.yaw_rad), std::sin(antenna.yaw_rad)});
    impl.road->add(t, enu.head<2>());
  }
  Step step;
  if (inputs.arrival != nullptr) {
    step.arrival = std::move(*inputs.arrival);
  } else {
    if (!impl.tracer && !impl.arrivals)
      impl.arrivals.emplace(impl.environment.make_propagator(impl.config.receiver().propagation));
    step.arrival = impl.tracer ? impl.environment.arrival(t, enu, impl.tracer)
                               : impl.arrivals->arrival(impl.environment, t, enu);
    if (!impl.config.receiver().fixed) tilt_antenna(step.arrival, antenna, frame);
  }
  impl.last_truth = antenna;
  step.epoch = impl.make_epoch(antenna, step.arrival, inputs.sensors);
  if (step.arrival.views.empty() && !impl.warned_empty) {
    impl.warned_empty = true;
    impl.warnings.push_back(
        fmt::format("no satellite has an orbit at {}: no fix from now on", geodesy::format_gpst(t, 0)));
  }
  return step;
}

ReceiverRunner::Step ReceiverRunner::observe(double seconds, const RigidPose& antenna) {
  return observe(pose_of(antenna, {impl_->scene->city.frame}, at(seconds)));
}

const Environment& ReceiverRunner::environment() const {
  return impl_->environment;
}

void ReceiverRunner::set_corrections(std::shared_ptr<const rtk::Corrections> corrections) {
  impl_->corrections = std::move(corrections);
}

ReceiverRunner::Step ReceiverRunner::observe_without_pose(GpsTime time) {
  Impl& impl = *impl_;
  const geodesy::LocalFrame& frame = impl.scene->city.frame;
  Pose truth = impl.last_truth.value_or(Pose{});
  if (!impl.last_truth) truth.position = frame.origin();
  truth.time = time;
  impl.go_to(time, false);
  truth.velocity_enu_mps.setZero();
  Step step;
  step.arrival.containment = raytrace::Containment::Unknown;
  step.arrival.ecef_from_enu = frame.ecef_from_local_rotation();
  step.arrival.antenna_enu = frame.local_from_geodetic(truth.position);
  step.epoch = impl.make_epoch(truth, step.arrival, nullptr);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  step.epoch.truth.position = {kNan, kNan, kNan};
  step.epoch.truth.velocity_enu_mps.setConstant(kNan);
  step.epoch.truth_ecef.setConstant(kNan);
  return step;
}

void ReceiverRunner::restart() {
  impl_->restart();
}

int ReceiverRunner::restart_count() const {
  return impl_->started;
}

std::vector<std::string> ReceiverRunner::take_warnings() {
  return std::exchange(impl_->warnings, {});
}

std::vector<const ReceiverRunner*> end_fault(std::span<ReceiverRunner* const> receivers,
                                             const std::string& name) {
  std::vector<const ReceiverRunner*> ended;
  std::optional<InputError> refused;
  for (ReceiverRunner* const each : receivers) {
    try {
      each->end_fault(name);
      ended.push_back(each);
    } catch (const InputError& error) {
      refused = error;
    }
  }
  if (ended.empty() && refused) throw *refused;
  return ended;
}

}  // namespace canyon::simulation
