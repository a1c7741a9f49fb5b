#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "canyon/city/fwd.hpp"
#include "canyon/run/environment.hpp"
#include "canyon/run/epoch.hpp"
#include "canyon/run/scenario/fwd.hpp"
#include "canyon/run/sky_builder.hpp"

namespace canyon::simulation {

class SensorRun;

struct RunOptions {
  int threads = 0;                          ///< 0: as many as cores; never more than those
  const std::atomic<bool>* stop = nullptr;  ///< set to end after the epochs in flight
  /// Epochs of all receivers that are computed together; a second block is computed ahead. At least 8
  /// instants. 0: 16 for each thread, whose paths fit a cache.
  std::size_t block = 0;
  /// Called now and then from the calling thread: epochs done, epochs in all.
  std::function<void(std::size_t, std::size_t)> progress;
};

struct RunResult {
  std::size_t epochs = 0;  ///< instants finished (not times receivers)
  std::size_t planned = 0;
  bool interrupted = false;
  double wall_s = 0;
  double simulated_s = 0;  ///< epochs times their interval
  /// Warnings, one line each: "rover: 12 epochs with the antenna inside a building".
  std::vector<std::string> warnings;
};

/// Replaces build_sky() where skies are shared.
using SkyBuilder =
    std::function<BuiltSky(const SkyConfig&, geodesy::GpsTime, geodesy::GpsTime, const geodesy::Geodetic&)>;

/// A scenario made ready: city loaded, sky chosen, trajectory checked against both.
class Simulation {
 public:
  /// Builds sky and trajectory from `scenario`; the city comes loaded (canyon::io reads files, see
  /// simulation/load_city.hpp). Throws InputError where the trajectory is outside the ephemerides, or more
  /// than 10 km from the city.
  Simulation(Scenario scenario, city::City city);
  /// The same over a scene that others share, and under a sky of theirs.
  Simulation(Scenario scenario, std::shared_ptr<CityScene> scene, const SkyBuilder& sky = build_sky);
  ~Simulation();

  [[nodiscard]] const Scenario& scenario() const;
  [[nodiscard]] const Environment& environment() const;
  [[nodiscard]] const Trajectory& trajectory() const;
  /// Broadcast records of the sky, for the RINEX navigation output; empty for SP3 and frozen skies.
  [[nodiscard]] const gnss::NavigationData& navigation() const;
  /// What the readers of city, sky and trajectory left out and guessed, and what of the scenario is probably
  /// a mistake.
  [[nodiscard]] const ReadReport& report() const;
  /// The report's warnings, one line each.
  [[nodiscard]] std::vector<std::string> warnings() const { return report().warnings(); }
  [[nodiscard]] geodesy::GpsTime begin() const;
  [[nodiscard]] double interval_s() const;
  [[nodiscard]] std::size_t epoch_count() const;

  /// Place and motion of the vehicle and of a receiver's antenna at `t` (clamp and lever arm applied). Throws
  /// InputError if the height above terrain is asked for and there is no terrain.
  [[nodiscard]] Pose vehicle_pose(geodesy::GpsTime t) const;
  [[nodiscard]] Pose antenna_pose(std::size_t receiver, geodesy::GpsTime t) const;
  /// The scenario's sensors at the run's begin (simulation/sensors/sensor_run.hpp), as epochs have them. Must
  /// not outlive this.
  [[nodiscard]] SensorRun sensors() const;

  /// The pure part runs on `threads`, receivers on the caller, each after the base whose corrections it takes
  /// (sinks get them as they stand in the scenario): same seed, same bytes. Every call
  /// begins anew. Where a sink or the pure part throws, epochs before it have been written, every other sink
  /// is finished, and the exception goes on to the caller.
  // Callers may use the sinks alone. NOLINTNEXTLINE(modernize-use-nodiscard)
  RunResult run(const std::vector<EpochSink*>& sinks, const RunOptions& options = {}) const;

 private:
  struct Impl;
  class Epochs;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::simulation
