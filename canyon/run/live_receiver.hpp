#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "canyon/paths/disturbance/faults/fault_timeline.hpp"
#include "canyon/receiver/corrections.hpp"
#include "canyon/run/environment.hpp"
#include "canyon/run/motion/pose.hpp"
#include "canyon/run/scenario/scenario.hpp"
#include "canyon/run/sensor_run.hpp"
#include "canyon/run/simulator.hpp"

namespace canyon::disturbance {
class Road;
}

namespace canyon::simulation {

/// What a receiver is given of an epoch beside its antenna.
struct EpochInputs {
  /// Of the vehicle since the epoch before, where the receiver's LiveConfig is with_sensors; their times
  /// count from LiveReceiver::start(). Null: none.
  const SensorBatch* sensors = nullptr;
  /// The antenna follows a trajectory or stays at a place: it never jumps.
  bool continuous = false;
  /// Paths that are traced already, which the step takes over. Null: it traces them.
  propagation::Arrival* arrival = nullptr;
};

/// One receiver driven epoch by epoch by who brings time, motion and surroundings: a Run, or a loop of your
/// own. Same seed and same epochs, same numbers. Not thread-safe.
class LiveReceiver {
 public:
  /// @param scene shared by the receivers of one world; the host moves its instances between steps.
  /// `propagation` as config.receiver says.
  /// @param start GPS time of the host's time 0
  /// @param sky of another receiver with the same config.sky and start, see shared_sky(), which has its
  /// warnings; null: its own
  /// @param way of the whole drive, for streets; null: known as far as it was driven
  /// Throws InputError where the sky has no satellite at `start` (see build_sky()), coefficients are missing,
  /// or the configuration has a base (Run makes both).
  LiveReceiver(LiveConfig config, std::shared_ptr<CityScene> scene, geodesy::GpsTime start,
               std::shared_ptr<const BuiltSky> sky = nullptr,
               std::shared_ptr<const disturbance::Road> way = nullptr);
  ~LiveReceiver();
  LiveReceiver(LiveReceiver&&) noexcept;

  [[nodiscard]] const LiveConfig& config() const;
  [[nodiscard]] geodesy::GpsTime start() const;
  /// The instant at a host's time [s] after start(). Throws InputError for one that is not finite, or beyond
  /// 1e9 s.
  [[nodiscard]] geodesy::GpsTime at(double seconds) const;
  [[nodiscard]] const Environment& environment() const;
  /// In use until observe() builds the next one: of nominal skies once a day.
  [[nodiscard]] const BuiltSky& sky() const;
  /// The same, for further receivers.
  [[nodiscard]] std::shared_ptr<const BuiltSky> shared_sky() const;

  /// The host rebuilt its world: rays go through this one from now on. Before the first step the receiver is
  /// made for it (ShadowingEnvironment::Auto, streets).
  void set_scene(std::shared_ptr<CityScene> scene);
  /// Rays of the host's own instead of the scene's; empty: back to the scene's.
  void set_tracer(Tracer tracer);

  /// Other options from the next step on: those of changed_live_config(). Sky and start stay, whatever
  /// `config` says of them. The receiver begins anew, as constructed: noise, clock, tracking and filter have
  /// no memory of before. Throws InputError where check() does; then nothing has changed.
  void set_config(LiveConfig config);
  /// Changes only LiveConfig::rate_hz, by which the host makes its steps: the receiver goes on.
  void set_rate(double rate_hz);
  /// Throws InputError for options out of range, and where `config` needs coefficients of the ionosphere that
  /// the sky does not have.
  void check(const LiveConfig& config) const;

  struct Step {
    Epoch epoch;  ///< receiver 0; its own `arrival` is null, `navigation` is arrival.messages
    propagation::Arrival arrival;  ///< the paths behind it, disturbed, in the scene's ENU frame
  };
  /// One epoch, at the pose's time. A time before the last step's begins anew, as constructed: a world that
  /// was reset gives the same numbers again. Throws InputError for a pose that is_possible() refuses.
  ///
  /// An antenna that is not EpochInputs::continuous and moves farther in one step of dt than
  ///     10 m + 2 v dt + min(a dt^2 / 2, kTeleport_mps dt), a = 200 m/s^2 (20 g),
  /// v the greater of its stated speed and that of the step before (unknown in the first step: kTeleport_mps
  /// / 2), was put elsewhere: the receiver restarts hot, with a warning. Receivers of vehicles work up to 4 g
  /// and 500 m/s (data sheet of u-blox M8 modules, UBX-15031506); 10 m and the factor of 2 are for poses that
  /// are measured or late (assumed).
  [[nodiscard]] Step observe(const Pose& antenna, const EpochInputs& inputs = {});
  /// The same of an antenna in the city's frame, at a host's time [s].
  [[nodiscard]] Step observe(double seconds, const RigidPose& antenna);

  /// Corrections that came since the last step, of a receiver elsewhere or of a stream; used by the next one.
  void give(std::shared_ptr<const relative::Corrections> corrections);

  /// One epoch of an antenna at an unknown place: no signal, no fix; placement is Unknown, the true place
  /// NaN.
  [[nodiscard]] Step lose(geodesy::GpsTime time);

  /// As constructed: faults are those of config() again.
  void restart();
  /// How often it has begun anew, by set_config(), restart() or a time that went back.
  [[nodiscard]] int begun() const;

  /// Puts a fault on the running timeline; the receiver goes on. @param text an item of a scenario's
  /// `faults:`, YAML or JSON; without `from_s` it begins with the next step. Returns its name; a fault of
  /// other `receivers` does nothing. Throws InputError naming `source`, line and cure.
  std::string add_fault(const std::string& text, const std::string& source = "fault");
  /// Ends a fault before the next step. Throws InputError if no fault of that name is or will be at work.
  void end_fault(const std::string& name);
  [[nodiscard]] std::vector<disturbance::FaultState> faults() const;

  /// Warnings since the last call, one line each: those of the configuration, stale ephemerides, the end of
  /// the orbits.
  [[nodiscard]] std::vector<std::string> take_warnings();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Ends a fault in those of `receivers` that have it, which need not be all; returns them. Throws InputError
/// where none has it.
std::vector<const LiveReceiver*> end_fault(std::span<LiveReceiver* const> receivers, const std::string& name);

}  // namespace canyon::simulation
