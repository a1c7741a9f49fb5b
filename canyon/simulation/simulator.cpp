#include "canyon/simulation/simulator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <exception>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/receiver/corrections.hpp"
#include "canyon/simulation/city_scene.hpp"
#include "canyon/simulation/correction_links.hpp"
#include "canyon/simulation/motion/antenna_pose.hpp"
#include "canyon/simulation/ordered_blocks.hpp"
#include "canyon/simulation/run_plan.hpp"
#include "canyon/simulation/run_receiver.hpp"
#include "canyon/simulation/scenario.hpp"
#include "canyon/simulation/scenario_trajectory.hpp"
#include "canyon/simulation/sensor_run.hpp"
#include "canyon/simulation/vehicle_sensors.hpp"

namespace canyon::simulation {
namespace {

using geodesy::format_gpst;
using geodesy::Geodetic;
using geodesy::GpsTime;

// A trajectory that is farther from the city has a wrong origin.
constexpr double kFarFromCity_m = 10e3;
// Masks below this, but not 0, are more likely radians: 0.17 rad are 10 deg.
constexpr double kLeastMask_deg = 1;
// Civil receivers end their service above 1,000 knots (the export limit of the Missile Technology Control
// Regime's annex, item 11.A.3: 600 m/s; receivers keep to the older 1,000 knots).
constexpr double kFastest_mps = 515;

// Horizontal distance [m] from a point to the city's bounds; 0 inside.
double distance_to(const city::Box& box, const Eigen::Vector3d& point) {
  const Eigen::Vector2d p = point.head<2>();
  const Eigen::Vector2d nearest = p.cwiseMax(box.min.head<2>()).cwiseMin(box.max.head<2>());
  return (p - nearest).norm();
}

void check_city(const Scenario& scenario, const city::City& city) {
  if (!scenario.city.is<OpenField>() && city.mesh.triangles.empty()) {
    throw scenario_error(scenario, fmt::format("the city '{}' is empty: it has no triangle", city.name),
                         "give another mesh, or city: {open: true} for an open field");
  }
}

void check_ionosphere(const Scenario& scenario, const BuiltSky& sky) {
  const bool needed =
      std::any_of(scenario.receivers.begin(), scenario.receivers.end(), [](const ReceiverConfig& receiver) {
        return receiver.options.ionosphere || receiver.options.fix.correct_ionosphere;
      });
  if (!needed) return;
  try {
    require_ionosphere(sky);
  } catch (const InputError& e) {
    throw scenario_error(scenario, e.problem(), e.cure());
  }
}

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
    for (ReceiverConfig& receiver : scenario.receivers) decide(receiver.options, environment);
    check_ionosphere(scenario, sky);
    for (const ReceiverConfig& receiver : scenario.receivers) {
      const std::string& from = receiver.options.corrections.from;
      if (!relative::is_stream(from)) continue;
      throw scenario_error(
          scenario,
          fmt::format("receiver '{}' takes corrections from '{}', a stream", receiver.options.name, from),
          from.starts_with(relative::kTopicAddress)
              ? "run it as a node of ROS 2 (docs/ros2.md), or name a base of the scenario"
              : "run it by canyon live, or name a base of the scenario");
    }
    (void)CorrectionLinks(scenario.receivers, scenario.seed);
    check_places();
    check_masks();
    check_faults();
    if (scenario.sensors.any()) smooth_motion();
    for (const ReceiverConfig& receiver : scenario.receivers) {
      try {
        check_sensors(scenario.sensors, receiver);
      } catch (const InputError& e) {
        throw scenario_error(scenario, e.problem(), e.cure());
      }
    }
    check_slopes();
    for (const ReceiverConfig& receiver : scenario.receivers) {
      propagators.push_back(environment.make_propagator(receiver.propagation));
    }
  }

  void check_places();
  void smooth_motion();
  void check_slopes();
  void check_masks();
  [[nodiscard]] std::size_t count_above(const Geodetic& place, double elevation_rad) const;
  void check_faults();
  void check_near(const city::Box& bounds, const Geodetic& place, GpsTime t) const;
  [[nodiscard]] Pose vehicle_pose(GpsTime t) const;
  [[nodiscard]] std::vector<receiver::Receiver> make_receivers() const;
  [[nodiscard]] std::optional<SensorRun> make_sensors(const std::vector<EpochSink*>& sinks) const;
  [[nodiscard]] Pose antenna_pose(std::size_t receiver, GpsTime t) const;
  [[nodiscard]] PureEpoch pure_epoch(std::size_t receiver, GpsTime t) const;
  [[nodiscard]] std::shared_ptr<const disturbance::Road> road() const;
  [[nodiscard]] std::vector<std::string> placement_warnings(
      const std::vector<std::array<std::size_t, 3>>& counts) const;

  Scenario scenario;
  RunPlan plan;
  BuiltSky sky;
  std::vector<std::string> warnings;
  std::shared_ptr<CityScene> city_scene;
  Environment environment;
  std::vector<propagation::Propagator> propagators;  // of each receiver
};

void Simulation::Impl::check_near(const city::Box& bounds, const Geodetic& place, GpsTime t) const {
  const city::City& city = environment.city();
  if (city.mesh.triangles.empty()) return;
  const double distance = distance_to(bounds, city.frame.local_from_geodetic(place));
  if (distance <= kFarFromCity_m) return;
  throw scenario_error(
      scenario,
      fmt::format(
          "the trajectory is {:.1f} km away from the city '{}' (at latitude {:.6f}, longitude {:.6f}, {})",
          distance / 1e3, city.name, geodesy::degrees(place.latitude_rad),
          geodesy::degrees(place.longitude_rad), format_gpst(t, 0)),
      fmt::format(
          "check city.origin (now latitude {:.6f}, longitude {:.6f}), and that the trajectory's angles "
          "are degrees in the order of its format",
          geodesy::degrees(city.frame.origin().latitude_rad),
          geodesy::degrees(city.frame.origin().longitude_rad)));
}

// Checks up to two thousand epochs of the trajectory: distance to the city, terrain below, speed.
void Simulation::Impl::check_places() {
  const std::size_t step = std::max<std::size_t>(1, plan.epochs() / 2000);
  const city::Box bounds = environment.city().bounds();
  bool fast = false;
  for (std::size_t k = 0; k < plan.epochs(); k += step) {
    const Pose pose = plan.trajectory.at(plan.at(k));
    const double speed_mps = pose.velocity_enu_mps.norm();
    if (speed_mps > kFastest_mps && !std::exchange(fast, true)) {
      warnings.push_back(fmt::format(
          "the trajectory moves at {:.0f} m/s ({}): faster than civil receivers work, 515 m/s (1,000 knots)",
          speed_mps, format_gpst(plan.at(k), 0)));
    }
    check_near(bounds, pose.position, plan.at(k));
    if (scenario.trajectory.height_above_terrain_m) (void)vehicle_pose(plan.at(k));
  }
  // A base may stand anywhere: beyond the city it has an open sky.
}

// Inertial sensors need a motion with a continuous acceleration: recorded positions and the height over a
// terrain become one.
void Simulation::Impl::smooth_motion() {
  std::optional<double>& clamped = scenario.trajectory.height_above_terrain_m;
  if (clamped && plan.trajectory.length_m() == 0) {
    plan.trajectory = Trajectory::fixed(plan.trajectory.begin(), vehicle_pose(plan.begin).position,
                                        plan.trajectory.end() - plan.trajectory.begin());
    clamped.reset();
  }
  if (plan.trajectory.smooth() && !clamped) return;
  const TrajectoryConfig& config = scenario.trajectory;
  if (!config.waypoints.empty() && !config.acceleration_mps2) {
    throw scenario_error(scenario, "sensors: the trajectory changes its speed and direction at once",
                         "give trajectory.acceleration_mps2, e.g. 2");
  }
  const Trajectory smooth = plan.trajectory.smoothed([this](GpsTime t) { return vehicle_pose(t); });
  double most_m = 0;
  const std::size_t step = std::max<std::size_t>(1, plan.epochs() / 2000);
  for (std::size_t k = 0; k < plan.epochs(); k += step) {
    const auto at = [&](const Pose& pose) { return geodesy::ecef_from_geodetic(pose.position); };
    most_m = std::max(most_m, (at(smooth.at(plan.at(k))) - at(vehicle_pose(plan.at(k)))).norm());
  }
  const std::string between = config.file ? fmt::format("interpolated between positions {:.3g} s apart and ",
                                                        smooth.sample_interval_s())
                                          : "";
  warnings.push_back(
      fmt::format("sensors: the trajectory is {}smoothed over about a second; it moves by up to {:.2f} m",
                  between, most_m));
  plan.trajectory = smooth;
  clamped.reset();
}

// A vehicle that stays level on a slope moves along its up axis, which a receiver with dead reckoning takes
// for impossible.
void Simulation::Impl::check_slopes() {
  const bool along =
      std::any_of(scenario.receivers.begin(), scenario.receivers.end(), [](const ReceiverConfig& receiver) {
        const auto& dead_reckoning = receiver.options.dead_reckoning;
        return dead_reckoning.enabled && dead_reckoning.non_holonomic;
      });
  if (!along) return;
  double most_mps = 0;
  const std::size_t step = std::max<std::size_t>(1, plan.epochs() / 2000);
  for (std::size_t k = 0; k < plan.epochs(); k += step) {
    const Pose pose = vehicle_pose(plan.at(k));
    most_mps = std::max(most_mps, std::abs(pose.velocity_enu_mps.dot(pose.up_enu())));
  }
  if (most_mps < 0.2) return;
  warnings.push_back(
      fmt::format("dead_reckoning: the vehicle moves along its up axis by up to {:.1f} m/s; set "
                  "trajectory.attitude: car, or dead_reckoning: {{non_holonomic: false}} if it flies",
                  most_mps));
}

std::size_t Simulation::Impl::count_above(const Geodetic& place, double elevation_rad) const {
  const std::vector<gnss::SatelliteId> ids = sky.sky->satellites();
  return static_cast<std::size_t>(std::count_if(ids.begin(), ids.end(), [&](gnss::SatelliteId id) {
    const auto line = orbit::line_of_sight(*sky.sky, id, plan.begin, geodesy::ecef_from_geodetic(place));
    return line && line->elevation_rad >= elevation_rad;
  }));
}

void Simulation::Impl::check_masks() {
  for (const ReceiverConfig& receiver : scenario.receivers) {
    const double mask_rad = receiver.options.fix.elevation_mask_rad;
    const Geodetic place = receiver.fixed ? receiver.fixed->place : plan.trajectory.at(plan.begin).position;
    const std::size_t above = count_above(place, 0), left = count_above(place, mask_rad);
    constexpr std::size_t kForAFix = 4;
    if (left < kForAFix && above >= kForAFix) {
      warnings.push_back(
          fmt::format("{}: elevation_mask_deg {:.3g} leaves {} of the {} satellites above the horizon at the "
                      "start: no fix",
                      receiver.options.name, geodesy::degrees(mask_rad), left, above));
    }
    if (!(mask_rad > 0 && mask_rad < geodesy::radians(kLeastMask_deg))) continue;
    warnings.push_back(fmt::format(
        "{}: elevation_mask_deg is {:.3g} deg; were radians meant? They would be {:.3g} deg",
        receiver.options.name, geodesy::degrees(mask_rad), geodesy::degrees(geodesy::degrees(mask_rad))));
  }
}

void Simulation::Impl::check_faults() {
  for (const disturbance::Fault& fault : scenario.faults) {
    const std::optional<double> own_s = fault.settings->duration_s();
    if (own_s && fault.until_s && std::abs(*fault.until_s - fault.from_s - *own_s) > 1e-6) {
      warnings.push_back(
          fmt::format("fault '{}' ends at {} s only in tables: the receiver takes some {} s, or search_s "
                      "and ephemeris_s",
                      fault.name, *fault.until_s, *own_s));
    }
    if (plan.at(plan.epochs() - 1) >= plan.begin + fault.from_s) continue;
    warnings.push_back(
        fmt::format("fault '{}' begins after {} s, when the run has ended", fault.name, fault.from_s));
  }
}

std::vector<receiver::Receiver> Simulation::Impl::make_receivers() const {
  std::vector<receiver::Receiver> receivers;
  const std::shared_ptr<const disturbance::Road> way = road();
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
  return SensorRun(scenario.sensors, scenario.seed, plan.begin, plan.trajectory);
}

Pose Simulation::Impl::vehicle_pose(GpsTime t) const {
  Pose pose = plan.trajectory.at(t);
  const std::optional<double>& height_m = scenario.trajectory.height_above_terrain_m;
  if (height_m && !clamp_to_terrain(pose, environment.city(), environment.scene(), *height_m)) {
    throw scenario_error(
        scenario,
        fmt::format("height_above_terrain_m: no terrain is at latitude {:.6f}, longitude {:.6f} ({})",
                    geodesy::degrees(pose.position.latitude_rad),
                    geodesy::degrees(pose.position.longitude_rad), format_gpst(pose.time, 3)),
        "use a mesh with terrain there (see city.terrain_names), or leave the key out");
  }
  return pose;
}

Pose Simulation::Impl::antenna_pose(std::size_t receiver, GpsTime t) const {
  const ReceiverConfig& config = scenario.receivers[receiver];
  if (config.fixed) return {t, config.fixed->place};
  return mounted_antenna(vehicle_pose(t), config.lever_arm_m);
}

PureEpoch Simulation::Impl::pure_epoch(std::size_t receiver, GpsTime t) const {
  PureEpoch pure;
  pure.truth = antenna_pose(receiver, t);
  pure.arrival = environment.arrival(t, environment.city().frame.local_from_geodetic(pure.truth.position),
                                     propagators[receiver]);
  if (!scenario.receivers[receiver].fixed) tilt_antenna(pure.arrival, pure.truth, environment.city().frame);
  return pure;
}

// Covers the whole trajectory, so that it does not depend on the epochs that are run.
std::shared_ptr<const disturbance::Road> Simulation::Impl::road() const {
  const auto streets_on = [](const ReceiverConfig& receiver) { return receiver.streets.enabled; };
  if (std::none_of(scenario.receivers.begin(), scenario.receivers.end(), streets_on)) return nullptr;
  auto road = std::make_shared<disturbance::Road>();
  const GpsTime first = plan.trajectory.begin();
  constexpr double kStep_s = 0.5;
  const auto steps = static_cast<std::int64_t>(std::ceil((plan.trajectory.end() - first) / kStep_s));
  for (std::int64_t k = 0; k <= steps; ++k) {
    const Pose pose = plan.trajectory.at(first + static_cast<double>(k) * kStep_s);
    road->add(pose.time, environment.city().frame.local_from_geodetic(pose.position).head<2>());
  }
  return road;
}

std::vector<std::string> Simulation::Impl::placement_warnings(
    const std::vector<std::array<std::size_t, 3>>& counts) const {
  std::vector<std::string> lines;
  for (std::size_t r = 0; r < counts.size(); ++r) {
    const auto say = [&](raytrace::Placement placement, const char* where) {
      const std::size_t n = counts[r][static_cast<std::size_t>(placement)];
      if (n == 0) return;
      lines.push_back(fmt::format("{}: {} {} with the antenna {}: no signal there",
                                  scenario.receivers[r].options.name, n, n == 1 ? "epoch" : "epochs", where));
    };
    say(raytrace::Placement::InsideBuilding, "inside a building");
    say(raytrace::Placement::UnderTerrain, "under the terrain");
  }
  return lines;
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
  std::vector<std::array<std::size_t, 3>> placements(receiver_count);
  std::vector<std::optional<double>> station_offsets(receiver_count);
  Progress progress(options.progress, result.planned);
  const EpochSink* broken = nullptr;
  std::exception_ptr failure;

  const auto running = [&options] { return options.stop == nullptr || !options.stop->load(); };
  const auto pure = [&](std::size_t instant) {
    std::vector<PureEpoch> epochs;
    epochs.reserve(receiver_count);
    for (std::size_t r = 0; r < receiver_count; ++r)
      epochs.push_back(impl.pure_epoch(r, impl.plan.at(instant)));
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
  result.warnings = impl.placement_warnings(placements);
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
