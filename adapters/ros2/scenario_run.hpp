#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "canyon/simulation/live_receiver.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::adapters::ros2 {

/// A scenario's own drive for a host with a clock: Simulation::run(), with the very numbers of `canyon
/// simulate`, in a thread of its own that is a few epochs ahead.
class ScenarioRun final : simulation::EpochSink {
 public:
  /// Begins at once. @param simulation of one receiver, and of its base, if any; @param threads as RunOptions
  ScenarioRun(std::shared_ptr<const simulation::Simulation> simulation, int threads);
  /// Ends the thread after the epochs in flight.
  ~ScenarioRun() override;
  ScenarioRun(const ScenarioRun&) = delete;
  ScenarioRun& operator=(const ScenarioRun&) = delete;

  /// Of the next epoch, since the first; one interval after the last where there is none.
  [[nodiscard]] std::int64_t next_ns() const { return static_cast<std::int64_t>(taken_) * interval_ns_; }
  [[nodiscard]] std::int64_t interval_ns() const { return interval_ns_; }
  /// Every epoch has been taken.
  [[nodiscard]] bool finished() const { return taken_ == simulation_->epoch_count(); }
  /// take() has something to say: an epoch, or what the run threw.
  [[nodiscard]] bool ready();
  /// The next epoch, or nothing where it is not made yet. Throws what the run threw.
  [[nodiscard]] std::optional<simulation::LiveReceiver::Step> take();

 private:
  static constexpr std::size_t kAhead = 64;

  void write(const simulation::Epoch& epoch) override;
  void finish() override {}

  const std::shared_ptr<const simulation::Simulation> simulation_;
  const std::int64_t interval_ns_;
  std::size_t taken_ = 0;
  std::mutex mutex_;
  std::condition_variable taken_one_;
  simulation::LiveReceiver::Step next_;  // until its base's epoch is there
  std::deque<simulation::LiveReceiver::Step> made_;
  std::exception_ptr failure_;
  std::atomic<bool> stop_{false};
  std::thread thread_;  // last, so that it finds everything else
};

}  // namespace canyon::adapters::ros2
