#include "canyon/simulation/simulator.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/progress.hpp"
#include "canyon/city/city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/motion/antenna_pose.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/ordered_blocks.hpp"
#include "canyon/simulation/receiver_group.hpp"
#include "canyon/simulation/run_checks.hpp"
#include "canyon/simulation/run_plan.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/sensor_run.hpp"
#include "canyon/simulation/trace_points.hpp"

namespace canyon::simulation {
namespace {

using geodesy::GpsTime;

// The arrivals at one receiver at one instant.
struct PureEpoch {
  Pose truth;
  propagation::Arrival arrival;
};

// Results of the pure part at successive instants, for all receivers.
struct EpochBlock {
  std::size_t first = 0;                       // instant
  std::vector<std::vector<PureEpoch>> epochs;  // [instant - first][receiver]
  std::exception_ptr failure;                  // of the first instant after them
};

bool is_set(const std::atomic<bool>* stop) {
  return stop != nullptr && stop->load();
}

}  // namespace

struct Simulation::Impl {
  Impl(Scenario s, std::shared_ptr<CityScene> scene, RunPlan p, const SkyBuilder& build)
      : scenario(std::move(s)),
        plan(std::move(p)),
        sky(std::make_shared<const BuiltSky>(
            build(scenario.sky, plan.begin, plan.end(), plan.trajectory.at(plan.begin).position))),
        city_scene(scene),
        environment(make_environment(std::move(scene), *sky, scenario.sky, scenario.seed)) {
    const auto log = [this](const std::vector<std::string>& lines) {
      report.add_line(ReadReport::Level::Guess, lines);
    };
    log(scenario.warnings);
    report.append(city_scene->city.notes);
    report.append(plan.report);
    report.append(sky->report);
    decide_receivers();
    log(check_run({scenario, plan, *sky, environment}));
    if (scenario.sensors.needs_smooth_motion()) log(smooth_motion(scenario, plan, environment));
    log(check_slopes({scenario, plan, *sky, environment}));
    for (const ReceiverConfig& receiver : scenario.receivers)
      propagators.push_back(environment.make_propagator(receiver.propagation));
  }

  void decide_receivers() {
    try {
      for (ReceiverConfig& receiver : scenario.receivers)
        decide_options(receiver.options, environment.errors().get(), sky->sky.get());
    } catch (const InputError& e) {
      throw scenario_error(scenario, e.problem(), e.hint());
    }
  }

  [[nodiscard]] Pose vehicle_pose(GpsTime t) const {
    return simulation::vehicle_pose(scenario, plan.trajectory, environment, t);
  }
  [[nodiscard]] ReceiverGroup make_run() const {
    RunnerConfig config = live_config(scenario, plan.begin, plan.schedule.interval_s());
    config.with_sensors = scenario.sensors.any();
    return {std::move(config), city_scene, plan.begin, sky,
            road_of(scenario, plan.trajectory, environment.city().frame)};
  }

  [[nodiscard]] SensorRun make_sensors() const {
    return SensorRun(
        scenario.sensors, scenario.seed, plan.begin,
        [this](GpsTime t) { return plan.trajectory.ecef_pose(t); },
        [this](GpsTime t) { return vehicle_pose(t); }, environment.city().geoid_undulation_m);
  }
  /// If a sink or a receiver needs them.
  [[nodiscard]] std::optional<SensorRun> make_sensors(const std::vector<EpochSink*>& sinks) const {
    const bool written =
        std::any_of(sinks.begin(), sinks.end(), [](const EpochSink* sink) { return sink->uses_sensors(); });
    const bool fused =
        std::any_of(scenario.receivers.begin(), scenario.receivers.end(),
                    [](const ReceiverConfig& receiver) { return receiver.options.dead_reckoning.enabled; });
    if (!written && !fused) return std::nullopt;
    return make_sensors();
  }
  [[nodiscard]] Pose antenna_pose(std::size_t receiver, GpsTime t) const {
    const ReceiverConfig& config = scenario.receivers[receiver];
    if (config.fixed) return {t, config.fixed->position};
    return mounted_antenna(vehicle_pose(t), config.lever_arm_m);
  }

  // Blocks are in order, because antennas keep their paths; within a block many threads trace.
  [[nodiscard]] EpochBlock trace_block(std::size_t first, std::size_t count,
                                       std::vector<RetracedAntenna>& antennas,
                                       const std::atomic<bool>* stop) const {
    const std::size_t receivers = scenario.receivers.size();
    EpochBlock block{first, {}, nullptr};
    try {
      for (std::size_t i = 0; i < count; ++i) {
        std::vector<PureEpoch> epochs(receivers);
        for (std::size_t r = 0; r < receivers; ++r) epochs[r].truth = antenna_pose(r, plan.at(first + i));
        block.epochs.push_back(std::move(epochs));
      }
    } catch (const InputError&) {
      block.failure = std::current_exception();
    }

    // Epochs of one receiver that share their paths.
    struct Group {
      std::size_t receiver, begin;
      std::vector<RetracedAntenna::Epoch> epochs;
    };
    std::vector<Group> groups;
    const geodesy::LocalFrame& frame = environment.city().frame;
    for (std::size_t r = 0; r < receivers; ++r) {
      for (std::size_t i = 0; i < block.epochs.size(); ++i) {
        const Pose& truth = block.epochs[i][r].truth;
        RetracedAntenna::Epoch epoch =
            antennas[r].next(plan.at(first + i), frame.local_from_geodetic(truth.position));
        if (i == 0 || epoch.first) groups.push_back({r, i, {}});
        groups.back().epochs.push_back(std::move(epoch));
      }
    }
    // Tasks already order the threads; ThreadSanitizer cannot see into TBB and needs this.
    std::atomic<std::size_t> traced{0};
    traced.fetch_add(1, std::memory_order_release);
    tbb::parallel_for(std::size_t{0}, groups.size(), [&](std::size_t g) {
      (void)traced.load(std::memory_order_acquire);
      const Group& group = groups[g];
      const auto trace = [&](std::size_t i) {
        if (is_set(stop)) return;
        (void)traced.load(std::memory_order_acquire);
        PureEpoch& pure = block.epochs[group.begin + i][group.receiver];
        pure.arrival = antennas[group.receiver].arrival(environment, group.epochs[i]);
        if (!scenario.receivers[group.receiver].fixed) tilt_antenna(pure.arrival, pure.truth, frame);
        traced.fetch_add(1, std::memory_order_release);
      };
      // The first epoch may trace the paths that the others use.
      trace(0);
      tbb::parallel_for(std::size_t{1}, group.epochs.size(), trace);
    });
    (void)traced.load(std::memory_order_acquire);
    return block;
  }

  Scenario scenario;
  RunPlan plan;
  std::shared_ptr<const BuiltSky> sky;
  ReadReport report;
  std::shared_ptr<CityScene> city_scene;
  Environment environment;
  std::vector<propagation::Propagator> propagators;  // of each receiver
};

Simulation::Simulation(Scenario scenario, city::City city)
    : Simulation(std::move(scenario), std::make_shared<CityScene>(std::move(city))) {}

Simulation::Simulation(Scenario scenario, std::shared_ptr<CityScene> scene, const SkyBuilder& sky) {
  if (!scene || !sky) throw InputError("a simulation needs a scene");
  const city::City& city = scene->city;
  for (const auto& [index, enu] : scenario.trajectory.local_waypoints)
    scenario.trajectory.waypoints.at(index) = city.frame.geodetic_from_local(enu);
  scenario.trajectory.local_waypoints.clear();
  put_on_terrain(scenario, *scene);
  for (ReceiverConfig& receiver : scenario.receivers)
    if (receiver.fixed) receiver.fixed->resolve(city.frame);
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
  return impl_->sky->navigation;
}
const ReadReport& Simulation::report() const {
  return impl_->report;
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
  if (receiver >= impl_->scenario.receivers.size())
    throw InputError(fmt::format("the scenario has no receiver {}", receiver));
  return impl_->antenna_pose(receiver, t);
}

// The epochs of one run, on the calling thread.
class Simulation::Epochs {
 public:
  Epochs(const Impl& impl, const std::vector<EpochSink*>& sinks, const RunOptions& options)
      : impl_(impl),
        sinks_(sinks),
        stop_(options.stop),
        run_(impl.make_run()),
        sensors_(impl.make_sensors(sinks)),
        containments_(run_.size()),
        progress_(options.progress, impl.plan.epochs()) {}

  /// Epochs of all receivers at the block's instants, unless the run is stopped.
  void take(EpochBlock& block) {
    for (std::size_t i = 0; i < block.epochs.size(); ++i) {
      if (is_set(stop_)) return;
      make_epochs(block.first + i, block.epochs[i]);
      done_ = block.first + i + 1;
      progress_.add(1);
    }
    if (block.failure) std::rethrow_exception(block.failure);
  }

  /// @param failure of the run so far
  void finish_sinks(std::exception_ptr failure) {
    simulation::finish_sinks(sinks_, broken_, std::move(failure));
    progress_.report();
  }

  [[nodiscard]] std::size_t done() const { return done_; }
  [[nodiscard]] std::vector<std::string> warnings() {
    std::vector<std::string> warnings = containment_warnings(impl_.scenario, containments_);
    for (std::size_t r = 0; r < run_.size(); ++r)
      for (const std::string& line : run_[r].take_warnings())
        warnings.push_back(fmt::format("{}: {}", impl_.scenario.receivers[r].options.name, line));
    for (const EpochSink* sink : sinks_)
      for (std::string& warning : sink->warnings()) warnings.push_back(std::move(warning));
    return warnings;
  }

 private:
  void make_epochs(std::size_t instant, std::vector<PureEpoch>& from) {
    const SensorBatch* batch = sensors_ ? &sensors_->until(impl_.plan.at(instant)) : nullptr;
    std::vector<ReceiverGroup::Due> due;
    std::vector<std::size_t> index(from.size());  // index of each receiver in `due`
    for (const std::size_t r : run_.order()) {
      index[r] = due.size();
      due.push_back({r, from[r].truth.time, from[r].truth, {batch, true, &from[r].arrival}});
      ++containments_[r][static_cast<std::size_t>(from[r].arrival.containment)];
    }
    const std::vector<ReceiverRunner::Step> made = run_.make(due, false);
    for (const std::size_t i : index) {
      for (EpochSink* sink : sinks_) {
        broken_ = sink;
        sink->write(made[i].epoch);
        broken_ = nullptr;
      }
    }
  }

  const Impl& impl_;
  const std::vector<EpochSink*>& sinks_;
  const std::atomic<bool>* stop_;
  ReceiverGroup run_;
  std::optional<SensorRun> sensors_;
  std::vector<ContainmentCounts> containments_;
  Progress progress_;
  std::size_t done_ = 0;  // instants
  const EpochSink* broken_ = nullptr;
};

RunResult Simulation::run(const std::vector<EpochSink*>& sinks, const RunOptions& options) const {
  const auto started = std::chrono::steady_clock::now();
  const Impl& impl = *impl_;
  const std::size_t count = impl.plan.epochs(), receiver_count = impl.scenario.receivers.size();
  Epochs run(impl, sinks, options);
  std::vector<RetracedAntenna> antennas(impl.propagators.begin(), impl.propagators.end());
  std::exception_ptr failure;
  try {
    // Memory is limited by the epochs of two blocks.
    const std::size_t epochs =
        options.block > 0 ? options.block : 16 * static_cast<std::size_t>(threads_of(options.threads));
    const std::size_t size = std::max<std::size_t>(8, epochs / receiver_count);
    for_each_in_order<EpochBlock>(
        (count + size - 1) / size, 1, options.threads, [&] { return !is_set(options.stop); },
        [&](std::size_t k) {
          return impl.trace_block(k * size, std::min(size, count - k * size), antennas, options.stop);
        },
        [&](std::size_t /*k*/, EpochBlock& block) { run.take(block); });
  } catch (...) {
    failure = std::current_exception();
  }
  run.finish_sinks(failure);

  RunResult result;
  result.epochs = run.done();
  result.planned = count;
  result.interrupted = result.epochs < result.planned;
  result.simulated_s = static_cast<double>(result.epochs) * interval_s();
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  result.warnings = run.warnings();
  return result;
}

}  // namespace canyon::simulation
