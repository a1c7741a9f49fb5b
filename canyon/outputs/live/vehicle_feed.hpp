#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/transport/link.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/outputs/live/session_clock.hpp"
#include "canyon/simulation/receiver_group.hpp"
#include "canyon/simulation/sensor_run.hpp"

namespace canyon::live {

/// The vehicles of a session: poses from the host or the trajectory, samples of sensors, and the epochs that
/// are due for them. Fixed receivers have a vehicle each, without poses.
class VehicleFeed {
 public:
  /// The session that uses the feed; it outlives the feed.
  struct SessionParts {
    const simulation::Scenario& scenario;
    const simulation::LiveOptions& options;
    const simulation::CityScene& scene;
    const simulation::Simulation* trajectory;  ///< null: poses are external
    SessionClock& clock;
    const simulation::ReceiverGroup& receivers;
    transport::Links& links;
    const std::vector<std::unique_ptr<encoding::EncodedStream>>& streams;
    std::function<void(std::int64_t now_ns)> pose_came;  ///< with stamps: computes the epochs due
    /// Computes the collected epochs and resets everything but the feed: a sender's time went back.
    std::function<void()> restart;
    std::function<void(const std::string&)> note, warn;  ///< log a line
  };
  /// A due epoch of one receiver.
  struct Due {
    simulation::ReceiverGroup::Due epoch;
    std::optional<SessionClock::Wall::time_point> pose_came = {};  ///< arrival of its pose
    simulation::SensorBatch samples = {};  ///< of its vehicle's sensors since the previous epoch
    std::uint64_t missed = 0;              ///< epochs skipped before it, since the machine was too slow
  };

  /// Opens the sources of poses. Throws InputError as Session().
  explicit VehicleFeed(SessionParts session);
  ~VehicleFeed();
  VehicleFeed(const VehicleFeed&) = delete;
  VehicleFeed& operator=(const VehicleFeed&) = delete;

  /// Starts the sensors that a receiver, a stream or a sink uses. @param written sinks use all of them
  void begin(bool written);
  /// Makes this epoch the next one of every receiver.
  void go_to(std::int64_t epoch);
  /// Collects the due epochs, in order for each vehicle, with stamps at most one block. Returns whether there
  /// may be more.
  bool gather(std::int64_t now_ns);
  /// The collected epochs.
  [[nodiscard]] std::vector<Due> take_due() { return std::exchange(due_, {}); }
  /// Whether a receiver's sensors have started.
  [[nodiscard]] bool has_sensors(std::size_t receiver) const { return sensors_[receiver].has_value(); }
  /// Sends the samples that have ended between epochs to streams, in real time.
  void sample_sensors(std::int64_t now_ns);
  /// Notes and requests of the sources; call it once a second. Returns the number of poses so far.
  [[nodiscard]] std::uint64_t check_sources();
  /// When gather() or sample_sensors() must be called if no pose arrives; empty: at once.
  [[nodiscard]] std::optional<SessionClock::Wall::time_point> next_due() const;
  /// Whether all moving vehicles have ended or, if none moves, all vehicles.
  [[nodiscard]] bool ended() const;
  /// Warns about dropped poses and ends the links of the sources. Throws the first of their exceptions.
  void finish();

 private:
  struct Schedule;
  struct Vehicle;

  /// Opens a source of poses.
  void open(std::size_t index);
  void receive(Vehicle& vehicle, const transport::Received& received);
  void read_log(Vehicle& vehicle, std::int64_t until_ns);
  /// Sets the time of all schedules.
  void begin_at(std::int64_t run_ns);
  /// With LiveOptions::resume: sets the run's time to the stamp of the first pose of all vehicles.
  void resume(const Vehicle& vehicle);
  /// Restarts the run after a restart of a vehicle's sender. False if other vehicles move.
  bool reset_state(Vehicle& vehicle);
  [[nodiscard]] bool sends_samples(std::size_t receiver) const;
  /// Sends samples that have ended at an instant to streams at once, in real time; stores them for epochs.
  void sample_sensors(const Vehicle& vehicle, std::size_t receiver, std::int64_t until_ns);
  [[nodiscard]] bool is_due(Vehicle& vehicle, const simulation::EpochSchedule& epochs, std::int64_t now_ns);
  [[nodiscard]] bool ended(const Vehicle& vehicle) const;
  void gather(Vehicle& vehicle, Schedule& of, std::int64_t now_ns);

  const SessionParts session_;
  std::vector<Vehicle> vehicles_;
  /// By receiver: the sensors of its vehicle. Empty: not needed, or no pose received.
  std::vector<std::optional<simulation::SensorRun>> sensors_;
  std::vector<simulation::SensorBatch> sensed_;  // their samples since the receiver's last epoch
  std::vector<Due> due_;
  SessionClock::Wall::time_point next_reset_warning_;
  bool resumed_ = false;
};

}  // namespace canyon::live
