#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "canyon/simulation/epoch_schedule.hpp"
#include "canyon/simulation/live_receiver.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::adapters::ros2 {

/// A scenario's own drive for a host with a clock, epoch by epoch.
class Drive {
 public:
  /// @param simulation of one receiver, and of its base, if any
  explicit Drive(std::shared_ptr<const simulation::Simulation> simulation);
  virtual ~Drive() = default;
  Drive(const Drive&) = delete;
  Drive& operator=(const Drive&) = delete;

  /// Time of the next epoch since the first; one interval after the last if none is left.
  [[nodiscard]] std::int64_t next_ns() const { return schedule_.next_ns(); }
  [[nodiscard]] std::int64_t interval_ns() const { return schedule_.interval_ns(); }
  /// Every epoch has been taken.
  [[nodiscard]] bool finished() const { return schedule_.over(); }
  /// take() has an epoch, or rethrows the run's exception.
  [[nodiscard]] virtual bool ready() = 0;
  /// The next epoch; empty: it is not made yet. Rethrows the run's exception.
  [[nodiscard]] virtual std::optional<simulation::LiveReceiver::Step> take() = 0;
  /// The samples of the vehicle's sensors that ended by `until_ns` since the first epoch and were not taken
  /// before, as far as they are made. Empty of drives whose receiver is driven step by step.
  [[nodiscard]] virtual simulation::SensorBatch take_sensors(std::int64_t /*until_ns*/) { return {}; }
  /// RTCM 3 from a topic, `now_ns` since the first epoch.
  virtual void receive_rtcm(std::string_view /*bytes*/, std::int64_t /*now_ns*/) {}
  /// Warnings since the last call, one line each.
  [[nodiscard]] virtual std::vector<std::string> take_warnings() { return {}; }

 protected:
  [[nodiscard]] const simulation::Simulation& simulation() const { return *simulation_; }
  void count_taken() { (void)schedule_.take(); }

 private:
  const std::shared_ptr<const simulation::Simulation> simulation_;
  simulation::EpochSchedule schedule_;
};

/// Simulation::run(), with the very numbers of `canyon simulate`, in a thread of its own that is a few epochs
/// ahead.
class ScenarioRun final : public Drive, simulation::EpochSink {
 public:
  /// Begins at once. @param threads as RunOptions
  ScenarioRun(std::shared_ptr<const simulation::Simulation> simulation, int threads);
  /// Ends the thread after the epochs in flight.
  ~ScenarioRun() override;

  [[nodiscard]] bool ready() override;
  [[nodiscard]] std::optional<simulation::LiveReceiver::Step> take() override;
  [[nodiscard]] simulation::SensorBatch take_sensors(std::int64_t until_ns) override;

 private:
  static constexpr std::size_t kAhead = 64;

  void write(const simulation::Epoch& epoch) override;
  void finish() override {}
  [[nodiscard]] bool uses_sensors() const override { return simulation().scenario().sensors.any(); }

  std::mutex mutex_;
  std::condition_variable taken_one_;
  simulation::LiveReceiver::Step next_;  // until its base's epoch is there
  std::deque<simulation::LiveReceiver::Step> made_;
  simulation::SensorBatch sensed_;  // and not taken yet
  std::exception_ptr failure_;
  std::atomic<bool> stop_{false};
  std::thread thread_;  // last, so that it finds everything else
};

}  // namespace canyon::adapters::ros2
