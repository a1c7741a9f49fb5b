#include "adapters/ros2/scenario_run.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

#include "canyon/base/input_error.hpp"

namespace canyon::adapters::ros2 {
namespace {

/// Moves the samples of `from` that ended by `until` behind those of `to`.
template <class Sample>
void move_until(geodesy::GpsTime until, std::vector<Sample>& from, std::vector<Sample>& to) {
  const auto end =
      std::find_if(from.begin(), from.end(), [until](const Sample& sample) { return sample.time > until; });
  std::move(from.begin(), end, std::back_inserter(to));
  from.erase(from.begin(), end);
}

void move_until(geodesy::GpsTime until, simulation::SensorBatch& from, simulation::SensorBatch& to) {
  move_until(until, from.imu, to.imu);
  move_until(until, from.wheels, to.wheels);
  move_until(until, from.barometer, to.barometer);
  move_until(until, from.magnetometer, to.magnetometer);
}

}  // namespace

ScenarioRun::ScenarioRun(std::shared_ptr<const simulation::Simulation> simulation, int threads)
    : simulation_(std::move(simulation)),
      schedule_(simulation_->interval_s(), static_cast<std::int64_t>(simulation_->epoch_count())),
      thread_([this, threads] {
        simulation::RunOptions options;
        options.threads = threads;
        options.stop = &stop_;
        options.block = 8;  // the first epoch shall not wait for many
        try {
          simulation_->run({this}, options);
        } catch (...) {
          const std::lock_guard lock(mutex_);
          failure_ = std::current_exception();
        }
      }) {}

ScenarioRun::ScenarioRun(std::shared_ptr<const simulation::Simulation> simulation, live::HostSetup setup)
    : simulation_(std::move(simulation)),
      schedule_(simulation_->interval_s(), static_cast<std::int64_t>(simulation_->epoch_count())) {
  setup.options.live =
      simulation::live_config(setup.options.live, 0, simulation_->begin(), simulation_->interval_s());
  driven_.emplace(std::move(setup));
}

ScenarioRun::~ScenarioRun() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  taken_one_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void ScenarioRun::write(const simulation::Epoch& epoch) {
  Step step{epoch, *epoch.arrival};
  step.epoch.arrival = nullptr;
  simulation::SensorBatch sensed;  // of the vehicle: once an epoch
  if (epoch.receiver == 0 && epoch.sensors != nullptr) sensed = *epoch.sensors;
  step.epoch.sensors = nullptr;
  if (epoch.receiver == 0) {
    next_ = std::move(step);
  } else {
    next_.base = std::make_shared<const Step>(std::move(step));
  }
  std::unique_lock lock(mutex_);
  move_until(epoch.truth.time, sensed, sensed_);
  if (epoch.receiver + 1 < simulation_->scenario().receivers.size()) return;
  taken_one_.wait(lock, [this] { return stop_ || made_.size() < kAhead; });
  made_.push_back(std::move(next_));
}

bool ScenarioRun::ready() {
  const std::lock_guard lock(mutex_);
  return driven_ || !made_.empty() || failure_ != nullptr;
}

std::optional<ScenarioRun::Step> ScenarioRun::take() {
  std::optional<Step> step;
  if (driven_) {
    if (finished()) return step;
    step = make();
  } else {
    const std::lock_guard lock(mutex_);
    if (made_.empty()) {
      if (failure_) std::rethrow_exception(failure_);
      return step;
    }
    step = std::move(made_.front());
    made_.pop_front();
  }
  (void)schedule_.take();
  taken_one_.notify_all();
  return step;
}

ScenarioRun::Step ScenarioRun::make() {
  const std::int64_t at_ns = next_ns();
  driven_->begin(at_ns, [&](std::string&) -> std::optional<live::HostedReceiver::Motion> {
    const auto now = simulation_->begin() + static_cast<double>(at_ns) * 1e-9;
    return simulation::antenna_state(simulation_->antenna_pose(0, now), driven_->frame().enu);
  });
  driven_->finish();
  if (driven_->step() == nullptr) throw InputError("the scenario's own drive ended");
  return *driven_->step();
}

void ScenarioRun::receive_rtcm(std::string_view bytes, std::int64_t now_ns) {
  if (driven_) driven_->take_rtcm(bytes, now_ns);
}

simulation::SensorBatch ScenarioRun::take_sensors(std::int64_t until_ns) {
  simulation::SensorBatch taken;
  const std::lock_guard lock(mutex_);
  move_until(simulation_->begin() + std::chrono::nanoseconds(until_ns), sensed_, taken);
  return taken;
}

}  // namespace canyon::adapters::ros2
