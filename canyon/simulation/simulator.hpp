#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "canyon/city/fwd.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/epoch.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/fwd.hpp"
#include "canyon/simulation/sky_builder.hpp"

namespace canyon::simulation {

class SensorRun;

struct RunOptions {
  int threads = 0;                          ///< 0: as many as cores, which is the maximum
  const std::atomic<bool>* stop = nullptr;  ///< set to end after the epochs in flight
  /// Number of epochs of all receivers that are computed together; a second block is computed ahead. At least
  /// 8 instants. 0: 16 per thread, whose paths fit a cache.
  std::size_t block = 0;
  /// Called repeatedly on the calling thread: epochs done, epochs in all.
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

/// Replaces build_sky() for shared skies.
using SkyBuilder =
    std::function<BuiltSky(const SkyConfig&, geodesy::GpsTime, geodesy::GpsTime, const geodesy::Geodetic&)>;

/// A scenario ready to run: city loaded, sky chosen, trajectory checked against both.
class Simulation {
 public:
  /// Builds sky and trajectory from `scenario`; the city is already loaded (canyon::io reads files, see
  /// simulation/load_city.hpp). Throws InputError if the trajectory is outside the ephemerides, or more than
  /// 10 km from the city.
  Simulation(Scenario scenario, city::City city);
  /// The same with a shared scene and a shared sky.
  Simulation(Scenario scenario, std::shared_ptr<CityScene> scene, const SkyBuilder& sky = build_sky);
  ~Simulation();

  [[nodiscard]] const Scenario& scenario() const;
  [[nodiscard]] const Environment& environment() const;
  [[nodiscard]] const Trajectory& trajectory() const;
  /// Broadcast records of the sky, for the RINEX navigation output; empty for SP3 and frozen skies.
  [[nodiscard]] const gnss::NavigationData& navigation() const;
  /// Reports of the readers of city, sky and trajectory (records left out, assumptions), and probable
  /// mistakes of the scenario.
  [[nodiscard]] const ReadReport& report() const;
  /// The report's warnings, one line each.
  [[nodiscard]] std::vector<std::string> warnings() const { return report().warnings(); }
  [[nodiscard]] geodesy::GpsTime begin() const;
  [[nodiscard]] double interval_s() const;
  [[nodiscard]] std::size_t epoch_count() const;

  /// Position and motion of the vehicle and of a receiver's antenna at `t` (clamp and lever arm applied).
  /// Throws InputError if the height above terrain is needed and there is no terrain.
  [[nodiscard]] Pose vehicle_pose(geodesy::GpsTime t) const;
  [[nodiscard]] Pose antenna_pose(std::size_t receiver, geodesy::GpsTime t) const;
  /// The scenario's sensors at the start of the run (simulation/sensor_run.hpp), as in epochs. Must
  /// not outlive this.
  [[nodiscard]] SensorRun sensors() const;

  /// The pure part (arrivals of signals) runs on `threads`, receivers on the calling thread, each after its
  /// base (sinks get them in the order of the scenario): the same seed gives the same bytes. Every call
  /// starts from the beginning. If a sink or the pure part throws, epochs before it have been written, every
  /// other sink is finished, and the exception is rethrown.
  // Callers may need only the sinks. NOLINTNEXTLINE(modernize-use-nodiscard)
  RunResult run(const std::vector<EpochSink*>& sinks, const RunOptions& options = {}) const;

 private:
  struct Impl;
  class Epochs;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::simulation
