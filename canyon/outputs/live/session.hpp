#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "canyon/base/statistics.hpp"
#include "canyon/simulation/epoch.hpp"
#include "canyon/simulation/receiver_runner.hpp"
#include "canyon/simulation/scenario/fwd.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::live {

/// Metrics of a run so far.
struct SessionMetrics {
  double host_s = 0;           ///< the scenario's time
  std::uint64_t epochs = 0;    ///< all receivers'
  std::uint64_t fixes = 0;     ///< epochs with a fix
  std::uint64_t no_truth = 0;  ///< epochs without a pose in time
  std::uint64_t missed = 0;    ///< skipped because the machine was too slow
  std::uint64_t poses = 0;
  std::string no_fix;  ///< the latest epoch without a fix, "rover: too few satellites"; empty: all have one
  Distribution latency{0};  ///< from a pose to the bytes of its epoch [s]
};

struct SessionOptions {
  const std::atomic<bool>* stop = nullptr;  ///< set: the run ends; null: never
  /// Log notes, and warnings of receivers and their skies (empty: uses `note`), one line each.
  std::function<void(const std::string&)> note, warn;
  /// Called once a second of real time.
  std::function<void(const SessionMetrics&)> progress;
};

/// Receivers of a scenario in real time: poses in, epochs out (docs/live.md).
/// Each vehicle has one source of poses. An epoch is due at its instant; it is computed when a pose of that
/// instant or later has arrived, or LiveOptions::wait_s after it, and sent at once. Receivers are computed on
/// as many threads as there are cores. If no pose arrived within the source's time-out, there is no truth:
/// the epoch has no signal and no fix, and its true position is NaN.
/// The results are those of simulation::ReceiverRunner, and for a trajectory those of Simulation::run().
class Session {
 public:
  /// Opens every address. Without start in the scenario or its trajectory the run begins at the next full
  /// second of real time. Throws InputError as Simulation does, for addresses that cannot be opened, sources
  /// with unknown receivers, two sources of one receiver, and receivers without a source.
  /// @param scenario without `live`: its trajectory, no streams
  Session(simulation::Scenario scenario, std::shared_ptr<simulation::CityScene> scene);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  [[nodiscard]] geodesy::GpsTime start() const;
  [[nodiscard]] double interval_s() const;
  [[nodiscard]] const simulation::Scenario& scenario() const;
  /// Runs to the end of the trajectory, of duration_s, of every log, or until stopped. Streams end with
  /// complete epochs.
  /// @param sinks get every epoch as from Simulation::run(), and are finished
  SessionMetrics run(const std::vector<simulation::EpochSink*>& sinks, const SessionOptions& options);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::live
