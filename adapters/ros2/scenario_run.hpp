#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>

#include "canyon/live/hosted_receiver.hpp"
#include "canyon/simulation/epoch_schedule.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::adapters::ros2 {

/// A scenario's own drive for a host with a clock, epoch by epoch, of one receiver and its base, if any.
class ScenarioRun final : simulation::EpochSink {
 public:
  using Step = simulation::LiveReceiver::Step;

  /// Begins Simulation::run(), with the very numbers of `canyon simulate`, in a thread of its own that is a
  /// few epochs ahead. @param threads as RunOptions
  ScenarioRun(std::shared_ptr<const simulation::Simulation> simulation, int threads);
  /// Of a receiver that takes its corrections from a topic: each epoch is made when it is taken, from the
  /// corrections that have come by then. @param setup of the same settings; its options' start and rate are
  /// the simulation's
  ScenarioRun(std::shared_ptr<const simulation::Simulation> simulation, live::HostSetup setup);
  /// Ends the thread after the epochs in flight.
  ~ScenarioRun() override;
  ScenarioRun(const ScenarioRun&) = delete;
  ScenarioRun& operator=(const ScenarioRun&) = delete;

  /// Time of the next epoch since the first; one interval after the last if none is left.
  [[nodiscard]] std::int64_t next_ns() const { return schedule_.next_ns(); }
  [[nodiscard]] std::int64_t interval_ns() const { return schedule_.interval_ns(); }
  /// Every epoch has been taken.
  [[nodiscard]] bool finished() const { return schedule_.over(); }
  /// take() has an epoch, or rethrows the run's exception.
  [[nodiscard]] bool ready();
  /// The next epoch; empty: it is not made yet. Rethrows the run's exception.
  [[nodiscard]] std::optional<Step> take();
  /// The samples of the vehicle's sensors that ended by `until_ns` since the first epoch and were not taken
  /// before, as far as they are made. Empty of receivers that take corrections from a topic.
  [[nodiscard]] simulation::SensorBatch take_sensors(std::int64_t until_ns);
  /// RTCM 3 from a topic, `now_ns` since the first epoch.
  void receive_rtcm(std::string_view bytes, std::int64_t now_ns);

 private:
  static constexpr std::size_t kAhead = 64;

  void write(const simulation::Epoch& epoch) override;
  void finish() override {}
  [[nodiscard]] bool uses_sensors() const override { return simulation_->scenario().sensors.any(); }
  [[nodiscard]] Step make();

  const std::shared_ptr<const simulation::Simulation> simulation_;
  simulation::EpochSchedule schedule_;
  std::optional<live::HostedReceiver> driven_;  // whose epochs are made when they are taken
  std::mutex mutex_;
  std::condition_variable taken_one_;
  Step next_;  // until its base's epoch is there
  std::deque<Step> made_;
  simulation::SensorBatch sensed_;  // and not taken yet
  std::exception_ptr failure_;
  std::atomic<bool> stop_{false};
  std::thread thread_;  // last, so that it finds everything else
};

}  // namespace canyon::adapters::ros2
