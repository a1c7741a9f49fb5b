#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "canyon/paths/disturbance/faults/fault_timeline.hpp"
#include "canyon/receiver/corrections.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/motion/pose.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/sensor_run.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::disturbance {
class Road;
}

namespace canyon::simulation {

/// Inputs of an epoch other than the antenna pose.
struct StepInputs {
  /// Samples of the vehicle's sensors since the previous epoch, if the receiver's RunnerConfig is
  /// with_sensors. Their times count from ReceiverRunner::start(). Null: none.
  const SensorBatch* sensors = nullptr;
  /// True: the antenna follows a trajectory or is at a fixed position, so it never jumps.
  bool continuous = false;
  /// Paths that are already traced; the step moves from them. Null: the step traces them.
  propagation::Arrival* arrival = nullptr;
};

/// One receiver, driven epoch by epoch by the caller, which supplies time, motion and surroundings:
/// Simulation or the user's own loop. The same seed and epochs give the same numbers. Not thread-safe.
class ReceiverRunner {
 public:
  /// @param scene shared by the receivers of one world; the host moves its instances between steps.
  /// `propagation` is taken from config.receiver.
  /// @param start GPS time of the host's time 0
  /// @param sky of another receiver with the same config.sky and start, see shared_sky(); the other receiver
  /// reports its warnings. Null: builds its own
  /// @param road route of the whole drive, for streets; null: known as far as it was driven
  /// Throws InputError if the sky has no satellite at `start` (see build_sky()), coefficients are missing, or
  /// the configuration has a base (Simulation supports bases).
  ReceiverRunner(RunnerConfig config, std::shared_ptr<CityScene> scene, geodesy::GpsTime start,
                 std::shared_ptr<const BuiltSky> sky = nullptr,
                 std::shared_ptr<const disturbance::Road> road = nullptr);
  ~ReceiverRunner();
  ReceiverRunner(ReceiverRunner&&) noexcept;

  [[nodiscard]] const RunnerConfig& config() const;
  [[nodiscard]] geodesy::GpsTime start() const;
  /// The instant at a host's time [s] after start(). InputError for a time not finite or beyond 1e9 s.
  [[nodiscard]] geodesy::GpsTime at(double seconds) const;
  [[nodiscard]] const Environment& environment() const;
  /// The sky in use, until observe() builds the next one: once a day if the sky is nominal.
  [[nodiscard]] const BuiltSky& sky() const;
  /// The same sky, for further receivers.
  [[nodiscard]] std::shared_ptr<const BuiltSky> shared_sky() const;

  /// Sets the scene for later rays, after the host has rebuilt its world. Before the first step the receiver
  /// is also set up for it (ShadowingEnvironment::Auto, streets).
  void set_scene(std::shared_ptr<CityScene> scene);
  /// Uses the host's rays instead of the scene's; empty: the scene's again.
  void set_tracer(Tracer tracer);

  /// Sets other options from the next step on: those of changed_live_config(). Sky and start do not change,
  /// whatever `config` has. The receiver restarts as constructed: noise, clock, tracking and filter are
  /// reset. Throws InputError if check() does; then nothing has changed.
  void set_config(RunnerConfig config);
  /// Changes only RunnerConfig::rate_hz, the rate of the host's steps, without a restart.
  void set_rate(double rate_hz);
  /// Throws InputError for options out of range, and for ionosphere coefficients that the sky lacks.
  void check(const RunnerConfig& config) const;

  struct Step {
    Epoch epoch;  ///< receiver 0; its own `arrival` is null, `navigation` is arrival.messages
    propagation::Arrival arrival;  ///< the disturbed paths of the epoch, in the scene's ENU frame
  };
  /// Computes one epoch, at the pose's time. A time before that of the last step restarts the receiver as
  /// constructed: a world that was reset gives the same numbers again. Throws InputError if is_possible() is
  /// false for the pose.
  ///
  /// An antenna that is not StepInputs::continuous has jumped if it moves farther in one step of dt than
  ///     10 m + 2 v dt + min(a dt^2 / 2, kTeleport_mps dt), a = 200 m/s^2 (20 g).
  /// v is the greater of its given speed and that of the previous step (unknown in the first step:
  /// kTeleport_mps / 2). After a jump the receiver restarts hot, with a warning. Receivers of vehicles work
  /// up to 4 g and 500 m/s (data sheet of u-blox M8 modules, UBX-15031506); 10 m and the factor of 2 allow
  /// for measured or late poses (assumed).
  [[nodiscard]] Step observe(const Pose& antenna, const StepInputs& inputs = {});
  /// The same for an antenna in the city's frame, at a host's time [s].
  [[nodiscard]] Step observe(double seconds, const RigidPose& antenna);

  /// Sets corrections that arrived since the last step, from a receiver or a stream, for the next step.
  void set_corrections(std::shared_ptr<const rtk::Corrections> corrections);

  /// An epoch at an unknown antenna position: no signal, no fix; containment Unknown, true position NaN.
  [[nodiscard]] Step observe_without_pose(geodesy::GpsTime time);

  /// Restarts as constructed; faults are those of config() again.
  void restart();
  /// Number of restarts by set_config(), restart() or a time that went back.
  [[nodiscard]] int restart_count() const;

  /// Adds a fault to the running timeline, without a restart. @param text an item of a scenario's `faults:`,
  /// YAML or JSON; without `from_s` it starts with the next step. Returns its name; a fault of other
  /// `receivers` has no effect. Throws InputError with `source`, line and hint.
  std::string add_fault(const std::string& text, const std::string& source = "fault");
  /// Ends a fault before the next step. Throws InputError if no fault of that name is or will be active.
  void end_fault(const std::string& name);
  [[nodiscard]] std::vector<disturbance::FaultState> faults() const;

  /// Warnings since the last call, one line each: of the configuration, stale ephemerides, end of the orbits.
  [[nodiscard]] std::vector<std::string> take_warnings();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Ends a fault in all `receivers` that have it; returns them. Throws InputError if none has it.
std::vector<const ReceiverRunner*> end_fault(std::span<ReceiverRunner* const> receivers,
                                             const std::string& name);

}  // namespace canyon::simulation
