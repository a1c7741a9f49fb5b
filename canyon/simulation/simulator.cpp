#include "canyon/simulation/simulator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/receiver/corrections.hpp"
#include "canyon/simulation/city_scene.hpp"
#include "canyon/simulation/correction_links.hpp"
#include "canyon/simulation/motion/antenna_pose.hpp"
#include "canyon/simulation/ordered_blocks.hpp"
#include "canyon/simulation/retracing.hpp"
#include "canyon/simulation/run_checks.hpp"
#include "canyon/simulation/run_motion.hpp"
#include "canyon/simulation/run_plan.hpp"
#include "canyon/simulation/run_receiver.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/scenario_trajectory.hpp"
#include "canyon/simulation/sensors/sensor_run.hpp"
#include "canyon/simulation/sensors/vehicle_sensors.hpp"

namespace canyon::simulation {
namespace {

using geodesy::GpsTime;

// Result of the pure part for one receiver at one instant.
struct PureEpoch {
  Pose truth;
  propagation::Arrival arrival;
};

// Calls `progress` at most ten times a second, and once at the end.
class Progress {
 public:
  Progress(const std::function<void(std::size_t, std::size_t)>& callback, std::size_t total)
      : callback_(callback), total_(total) {}
  void report(std::size_t done) {
    const auto now = Clock::now();
    if (!callback_ || now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    callback_(done, total_);
  }
  void finish(std::size_t done) {
    if (callback_) callback_(done, total_);
  }

 private:
  using Clock = std::chrono::steady_clock;
  const std::function<void(std::size_t, std::size_t)>& callback_;
  std::size_t total_;
  Clock::time_point last_ = Clock::now();
};

}  // namespace

struct Simulation::Impl {
  Impl(Scenario s, std::shared_ptr<CityScene> scene, RunPlan p, const SkyBuilder& build)
      : scenario(std::move(s)),
        plan(std::move(p)),
        sky(build(scenario.sky, plan.begin, plan.end(), plan.trajectory.at(plan.begin).position)),
        city_scene(scene),
        environment(make_environment(std::move(scene), sky, scenario.sky, scenario.seed)) {
    warnings = scenario.warnings;
    warnings.insert(warnings.end(), plan.warnings.begin(), plan.warnings.end());
    warnings.insert(warnings.end(), sky.warnings.begin(), sky.warnings.end());
    decide_receivers();
    const auto say = [this](std::vector<std::string> lines) {
      for (std::string& line : lines) warnings.push_back(std::move(line));
    };
    say(check_run({scenario, plan, sky, environment}));
    if (scenario.sensors.feel_motion()) say(smooth_motion(scenario, plan, environment));
    say(check_slopes({scenario, plan, sky, environment}));
    for (const ReceiverConfig& receiver : scenario.receivers) {
      propagators.push_back(environment.make_propagator(receiver.propagation));
    }
  }

  void decide_receivers() {
    try {
      for (ReceiverConfig& receiver : scenario.receivers) decide(receiver.options, environment);
    } catch (const InputError& e) {
      throw scenario_error(scenario, e.problem(), e.cure());
    }
  }

  [[nodiscard]] Pose vehicle_pose(GpsTime t) const {
    return simulation::vehicle_pose(scenario, plan.trajectory, environment, t);
  }
  [[nodiscard]] std::vector<receiver::Receiver> make_receivers() const;
  [[nodiscard]] SensorRun make_sensors() const;
  [[nodiscard]] std::optional<SensorRun> make_sensors(const std::vector<EpochSink*>& sinks) const;
  [[nodiscard]] Pose antenna_pose(std::size_t receiver, GpsTime t) const;
  [[nodiscard]] PureEpoch pure_epoch(std::size_t receiver, std::size_t instant, RetracedRun& arrivals) const;

  Scenario scenario;
  RunPlan plan;
  BuiltSky sky;
  std::vector<std::string> warnings;
  std::shared_ptr<CityScene> city_scene;
  Environment environment;
  std::vector<propagation::Propagator> propagators;  // of each receiver
};

std::vector<receiver::Receiver> Simulation::Impl::make_receivers() const {
  std::vector<receiver::Receiver> receivers;
  const std::shared_ptr<const disturbance::Road> way =
      road_of(scenario, plan.trajectory, environment.city().frame);
  for (const ReceiverConfig& config : scenario.receivers) {
    std::vector<disturbance::Source> sources;
    auto faults =
        std::make_shared<disturbance::FaultTimeline>(plan.begin, scenario.faults, config.options.name);
    faults->set_surroundings(surroundings(city_scene, sky.sky));
    if (!faults->empty()) sources.push_back(disturbance::FaultTimeline::source(faults));
    receivers.push_back(make_receiver(config, scenario.seed, environment, way, sources));
  }
  return receivers;
}

// Where a sink or a receiver needs them.
std::optional<SensorRun> Simulation::Impl::make_sensors(const std::vector<EpochSink*>& sinks) const {
  const bool written =
      std::any_of(sinks.begin(), sinks.end(), [](const EpochSink* sink) { return sink->uses_sensors(); });
  const bool fused =
      std::any_of(scenario.receivers.begin(), scenario.receivers.end(),
                  [](const ReceiverConfig& receiver) { return receiver.options.dead_reckoning.enabled; });
  if (!written && !fused) return std::nullopt;
  return make_sensors();
}

SensorRun Simulation::Impl::make_sensors() const {
  return SensorRun(
      scenario.sensors, scenario.seed, plan.begin, body_along(plan.trajectory),
      [this](GpsTime t) { return vehicle_pose(t); }, environment.city().geoid_undulation_m);
}

Pose Simulation::Impl::antenna_pose(std::size_t receiver, GpsTime t) const {
  const ReceiverConfig& config = scenario.receivers[receiver];
  if (config.fixed) return {t, config.fixed->place};
  return mounted_antenna(vehicle_pose(t), config.lever_arm_m);
}

PureEpoch Simulation::Impl::pure_epoch(std::size_t receiver, std::size_t instant,
                                       RetracedRun& arrivals) const {
  PureEpoch pure;
  pure.truth = antenna_pose(receiver, plan.at(instant));
  pure.arrival = arrivals.arrival(receiver, instant);
  if (!scenario.receivers[receiver].fixed) tilt_antenna(pure.arrival, pure.truth, environment.city().frame);
  return pure;
}

Epoch observe_epoch(receiver::Receiver& receiver, const Pose& truth, propagation::Arrival& arrival,
                    const Environment& environment, const relative::Corrections* corrections,
                    const receiver::VehicleSensors* sensors) {
  const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(truth.position);
  Epoch epoch;
  epoch.truth = truth;
  epoch.truth_ecef = geodesy::ecef_from_geodetic(truth.position);
  epoch.placement = arrival.placement;
  epoch.environment = &environment;
  epoch.geoid_undulation_m = environment.city().geoid_undulation_m;
  epoch.observed =
      receiver.observe({{truth.time, epoch.truth_ecef, enu_from_ecef.transpose() * truth.velocity_enu_mps},
                        arrival,
                        environment.sky(),
                        environment.klobuchar(),
                        corrections,
                        sensors});
  epoch.navigation = arrival.messages.get();  // disturbances may have replaced them
  epoch.faults = epoch.observed.events.faults;
  if (epoch.observed.fix.solved()) {
    epoch.error_enu_m = enu_from_ecef * (epoch.observed.fix.position_ecef - epoch.truth_ecef);
  }
  return epoch;
}

Simulation::Simulation(Scenario scenario, city::City city)
    : Simulation(std::move(scenario), std::make_shared<CityScene>(std::move(city))) {}

Simulation::Simulation(Scenario scenario, std::shared_ptr<CityScene> scene, const SkyBuilder& sky) {
  if (!scene || !sky) throw InputError("a simulation needs a scene");
  const city::City& city = scene->city;
  for (const auto& [index, enu] : scenario.trajectory.local_waypoints) {
    scenario.trajectory.waypoints.at(index) = city.frame.geodetic_from_local(enu);
  }
  scenario.trajectory.local_waypoints.clear();
  put_on_terrain(scenario, *scene);
  for (ReceiverConfig& receiver : scenario.receivers) {
    if (receiver.fixed) receiver.fixed->settle(city.frame);
  }
  RunPlan plan = make_plan(scenario, city.geoid_undulation_m);
  check_city(scenario, city);
  impl_ = std::make_unique<Impl>(std::move(scenario), std::move(scene), std::move(plan), sky);
}
Simulation::~Simulation() = default;

const Scenario& Simulation::scenario() const {
  return impl_->scenario;
}
const Environment& Simulation::environment() const {
  return impl_->environment;
}
const Trajectory& Simulation::trajectory() const {
  return impl_->plan.trajectory;
}
const gnss::NavigationData& Simulation::navigation() const {
  return impl_->sky.navigation;
}
const std::vector<std::string>& Simulation::warnings() const {
  return impl_->warnings;
}
GpsTime Simulation::begin() const {
  return impl_->plan.begin;
}
double Simulation::interval_s() const {
  return impl_->plan.schedule.interval_s();
}
std::size_t Simulation::epoch_count() const {
  return impl_->plan.epochs();
}

Pose Simulation::vehicle_pose(GpsTime t) const {
  return impl_->vehicle_pose(t);
}

SensorRun Simulation::sensors() const {
  return impl_->make_sensors();
}

Pose Simulation::antenna_pose(std::size_t receiver, GpsTime t) const {
  if (receiver >= impl_->scenario.receivers.size()) {
    throw InputError(fmt::format("the scenario has no receiver {}", receiver));
  }
  return impl_->antenna_pose(receiver, t);
}

RunResult Simulation::run(const std::vector<EpochSink*>& sinks, const RunOptions& options) const {
  const Impl& impl = *impl_;
  const auto started = std::chrono::steady_clock::now();
  const std::size_t receiver_count = impl.scenario.receivers.size();
  RunResult result;
  result.planned = impl.plan.epochs();

  std::vector<receiver::Receiver> receivers = impl.make_receivers();
  CorrectionLinks links(impl.scenario.receivers, impl.scenario.seed);
  std::optional<SensorRun> sensors = impl.make_sensors(sinks);
  std::vector<std::optional<receiver::VehicleSensors>> felt;
  for (const ReceiverConfig& config : impl.scenario.receivers)
    felt.push_back(vehicle_sensors(impl.scenario.sensors, config));
  std::vector<PlacementCounts> placements(receiver_count);
  std::vector<std::optional<double>> station_offsets(receiver_count);
  Progress progress(options.progress, result.planned);
  const EpochSink* broken = nullptr;
  std::exception_ptr failure;

  const auto running = [&options] { return options.stop == nullptr || !options.stop->load(); };
  RetracedRun arrivals(
      impl.environment, impl.propagators, result.planned, [&](std::size_t k) { return impl.plan.at(k); },
      [&](std::size_t r, std::size_t k) {
        return impl.environment.city().frame.local_from_geodetic(
            impl.antenna_pose(r, impl.plan.at(k)).position);
      });
  const auto pure = [&](std::size_t instant) {
    std::vector<PureEpoch> epochs;
    epochs.reserve(receiver_count);
    for (std::size_t r = 0; r < receiver_count; ++r) epochs.push_back(impl.pure_epoch(r, instant, arrivals));
    return epochs;
  };
  const auto write = [&](const Epoch& epoch) {
    for (EpochSink* sink : sinks) {
      broken = sink;
      sink->write(epoch);
      broken = nullptr;
    }
  };
  std::vector<DueEpoch> due;
  for (const std::size_t r : links.order()) due.push_back({r, {}});
  const auto observe = [&](std::size_t instant, std::vector<PureEpoch>& epochs) {
    for (DueEpoch& each : due) each.time = epochs[each.receiver].truth.time;
    const SensorBatch* batch = sensors ? &sensors->until(impl.plan.at(instant)) : nullptr;
    std::vector<Epoch> made(receiver_count);
    links.observe(due, false, [&](std::size_t i, const auto& corrections) -> Epoch& {
      const std::size_t r = due[i].receiver;
      PureEpoch& from = epochs[r];
      from.arrival.messages = unowned(impl.sky.navigation);
      if (felt[r]) felt[r]->readings = readings_of(*batch, impl.scenario.sensors, impl.plan.begin);
      made[r] = observe_epoch(receivers[r], from.truth, from.arrival, impl.environment, corrections.get(),
                              felt[r] ? &*felt[r] : nullptr);
      made[r].arrival = &from.arrival;
      made[r].sensors = batch;
      ++placements[r][static_cast<std::size_t>(from.arrival.placement)];
      if (made[r].observed.station_offset_m) station_offsets[r] = made[r].observed.station_offset_m;
      return made[r];
    });
    for (const Epoch& epoch : made) write(epoch);
    result.epochs = instant + 1;
    arrivals.forget_before(result.epochs);
    progress.report(result.epochs);
  };

  try {
    // Memory is bounded by the epochs of two blocks.
    const std::size_t epochs =
        options.block > 0 ? options.block : 16 * static_cast<std::size_t>(threads_of(options.threads));
    const std::size_t block = std::max<std::size_t>(8, epochs / receiver_count);
    for_each_in_order<std::vector<PureEpoch>>(result.planned, block, options.threads, running, pure, observe);
  } catch (...) {
    failure = std::current_exception();
  }
  // A sink that failed is not finished, so that its file stays absent.
  for (EpochSink* sink : sinks) {
    if (sink == broken) continue;
    try {
      sink->finish();
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  }
  if (failure) std::rethrow_exception(failure);

  progress.finish(result.epochs);
  result.interrupted = result.epochs < result.planned;
  result.simulated_s = static_cast<double>(result.epochs) * interval_s();
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  result.warnings = placement_warnings(impl.scenario, placements);
  for (std::size_t r = 0; r < receiver_count; ++r) {
    const auto warning = receiver::wrong_station_warning(station_offsets[r]);
    if (warning) {
      result.warnings.push_back(fmt::format("{}: {}", impl.scenario.receivers[r].options.name, *warning));
    }
  }
  for (const EpochSink* sink : sinks) {
    for (std::string& warning : sink->warnings()) result.warnings.push_back(std::move(warning));
  }
  return result;
}

}  // namespace canyon::simulation
