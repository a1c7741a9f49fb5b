#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/analysis/study/axis.hpp"
#include "canyon/analysis/study/run_store.hpp"
#include "canyon/analysis/study/study.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::study {

[[nodiscard]] Manifest manifest_of(const StudyPlan& plan);

/// The shard, [0, shards), that computes a run if several machines share a study. Of each `shards`
/// consecutive runs every shard gets one. The assignment changes from group to group, so that no shard always
/// gets the same values of an axis.
[[nodiscard]] std::size_t shard_of(std::size_t run, std::size_t shards);

/// Computes runs, which share cities as read, cities as sampled by one seed, and skies. Thread-safe.
class RunMaker {
 public:
  explicit RunMaker(const StudyPlan& plan);
  ~RunMaker();
  RunMaker(const RunMaker&) = delete;
  RunMaker& operator=(const RunMaker&) = delete;

  /// Computes a run; its metrics are those of `canyon simulate`. An InputError of the scenario becomes
  /// RunRecord::problem; other exceptions, OutputError among them, are thrown. Empty if `stop` was set before
  /// the run's end.
  [[nodiscard]] std::optional<RunRecord> make(std::size_t number, int threads,
                                              const std::atomic<bool>* stop = nullptr) const;
  /// The scenario of a run as for `canyon simulate`.
  [[nodiscard]] simulation::Scenario scenario(std::size_t number) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct RunnerOptions {
  int threads = 0;  ///< 0: as many as cores
  const std::atomic<bool>* stop = nullptr;
  std::function<void(std::size_t done)> progress;  ///< from any thread, one at a time
  /// The next of `todo` for this process; empty: the first one not yet returned.
  std::function<std::size_t()> next;
};
/// Computes this process's part of `todo`, and stores each run. Throws the first exception of any thread,
/// after the others have ended their run.
void run_all(const RunMaker& maker, RunStore& store, const std::vector<std::size_t>& todo,
             const RunnerOptions& options);

/// A random drive through the streets of a city: the same for the same city, options, seed and number. It
/// starts at a random point between buildings. Each leg is the longest of a few sampled candidates that are
/// free of obstacles at the antenna's height and have, on 80 % of their length, houses within 40 m on both
/// sides. It turns back only if no other direction is free, keeps 3 m from the obstacle at a leg's end, and
/// is part of a route that leads 75 m from its start, out of courts. Throws InputError if no drive is found.
[[nodiscard]] simulation::TrajectoryConfig random_drive(const simulation::CityScene& scene,
                                                        const DriveOptions& options, std::uint64_t seed,
                                                        const std::string& number);

}  // namespace canyon::study
