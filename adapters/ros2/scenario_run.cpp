#include "adapters/ros2/scenario_run.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

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

Drive::Drive(std::shared_ptr<const simulation::Simulation> simulation)
    : simulation_(std::move(simulation)),
      schedule_(simulation_->interval_s(), static_cast<std::int64_t>(simulation_->epoch_count())) {}

ScenarioRun::ScenarioRun(std::shared_ptr<const simulation::Simulation> simulation, int threads)
    : Drive(std::move(simulation)), thread_([this, threads] {
        simulation::RunOptions options;
        options.threads = threads;
        options.stop = &stop_;
        options.block = 8;  // the first epoch shall not wait for many
        try {
          this->simulation().run({this}, options);
        } catch (...) {
          const std::lock_guard lock(mutex_);
          failure_ = std::current_exception();
        }
      }) {}

ScenarioRun::~ScenarioRun() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  taken_one_.notify_all();
  thread_.join();
}

void ScenarioRun::write(const simulation::Epoch& epoch) {
  simulation::LiveReceiver::Step step{epoch, *epoch.arrival};
  step.epoch.arrival = nullptr;
  simulation::SensorBatch sensed;  // of the vehicle: once an epoch
  if (epoch.receiver == 0 && epoch.sensors != nullptr) sensed = *epoch.sensors;
  step.epoch.sensors = nullptr;
  if (epoch.receiver == 0) {
    next_ = std::move(step);
  } else {
    next_.base = std::make_shared<const simulation::LiveReceiver::Step>(std::move(step));
  }
  std::unique_lock lock(mutex_);
  move_until(epoch.truth.time, sensed, sensed_);
  if (epoch.receiver + 1 < simulation().scenario().receivers.size()) return;
  taken_one_.wait(lock, [this] { return stop_ || made_.size() < kAhead; });
  made_.push_back(std::move(next_));
}

bool ScenarioRun::ready() {
  const std::lock_guard lock(mutex_);
  return !made_.empty() || failure_ != nullptr;
}

std::optional<simulation::LiveReceiver::Step> ScenarioRun::take() {
  std::optional<simulation::LiveReceiver::Step> step;
  {
    const std::lock_guard lock(mutex_);
    if (made_.empty()) {
      if (failure_) std::rethrow_exception(failure_);
      return step;
    }
    step = std::move(made_.front());
    made_.pop_front();
  }
  count_taken();
  taken_one_.notify_all();
  return step;
}

simulation::SensorBatch ScenarioRun::take_sensors(std::int64_t until_ns) {
  simulation::SensorBatch taken;
  const std::lock_guard lock(mutex_);
  move_until(simulation().begin() + std::chrono::nanoseconds(until_ns), sensed_, taken);
  return taken;
}

}  // namespace canyon::adapters::ros2
