#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/run/environment.hpp"
#include "canyon/run/scenario/scenario.hpp"
#include "canyon/studies/study/axis.hpp"
#include "canyon/studies/study/run_store.hpp"
#include "canyon/studies/study/study.hpp"

namespace canyon::study {

[[nodiscard]] Manifest manifest_of(const StudyPlan& plan);

/// The shard, [0, shards), that computes a run where several machines share a study. Of each `shards`
/// consecutive runs every shard gets one; which one changes from group to group, so that no shard gets the
/// same values of an axis throughout.
[[nodiscard]] std::size_t shard_of(std::size_t run, std::size_t shards);

/// Computes runs, and shares between them what they have in common: cities as they are read, cities as they
/// were drawn by one seed, skies. Thread-safe.
class RunMaker {
 public:
  explicit RunMaker(const StudyPlan& plan);
  ~RunMaker();
  RunMaker(const RunMaker&) = delete;
  RunMaker& operator=(const RunMaker&) = delete;

  /// Computes a run; its figures are those of `canyon simulate`. An InputError of the scenario becomes
  /// RunRecord::problem; other exceptions, OutputError among them, are thrown. Empty where `stop` was set
  /// before the run's end.
  [[nodiscard]] std::optional<RunRecord> make(std::size_t number, int threads,
                                              const std::atomic<bool>* stop = nullptr) const;
  /// The scenario of a run as `canyon simulate` takes it.
  [[nodiscard]] simulation::Scenario scenario(std::size_t number) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct RunnerOptions {
  int threads = 0;  ///< 0: as many as cores
  const std::atomic<bool>* stop = nullptr;
  std::function<void(std::size_t done)> progress;  ///< from any thread, one at a time
  /// The next of `todo` for this process; empty: the first that it has not had.
  std::function<std::size_t()> next;
};
/// Runs what this process takes of `todo`, keeping each in the store. Throws the first exception of any
/// thread, after the others have ended their run.
void run_all(const RunMaker& maker, RunStore& store, const std::vector<std::size_t>& todo,
             const RunnerOptions& options);

/// A drive drawn at random through the streets of a city: the same for the same city, options, seed and
/// number. It begins anywhere between its buildings; each leg goes the longest of a few drawn ways on which
/// no ray meets anything at the antenna's height and that have, on 80 % of their length, houses within 40 m
/// on both sides. It turns back only where nothing else is free, keeps 3 m from what ends a leg, and is part
/// of a way that leads 75 m from its beginning, out of courts. Throws InputError where no drive is found.
[[nodiscard]] simulation::TrajectoryConfig random_drive(const simulation::CityScene& scene,
                                                        const DriveOptions& options, std::uint64_t seed,
                                                        const std::string& number);

}  // namespace canyon::study
