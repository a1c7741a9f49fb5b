#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "adapters/common/epoch_publisher.hpp"
#include "adapters/common/host_settings.hpp"
#include "adapters/common/options_desk.hpp"
#include "adapters/common/pose_motion.hpp"
#include "adapters/common/world_scene.hpp"
#include "canyon/output/encoder.hpp"
#include "canyon/simulation/epoch_schedule.hpp"

namespace canyon::adapters {

/// The place of a receiver in messages: "plugin 'gnss' of model 'car', sensor 'gps'".
[[nodiscard]] std::string place_name(const ReceiverIdentity& identity);

/// `settings.origin` first, then the host's; at latitude 0, longitude 0 with a line in `warnings` where it is
/// the host's.
[[nodiscard]] WorldFrame world_frame(const std::optional<HostOrigin>& host, const HostSettings& settings,
                                     std::vector<std::string>& warnings);

/// The scene that a receiver of these settings sees of the world of this name.
[[nodiscard]] WorldScene::Options scene_options(const std::string& world, const HostSettings& settings,
                                                const WorldFrame& frame);

/// GPS time of a world's time 0 where nobody says it: the machine's when its first receiver was loaded, the
/// same for all. `world`: any address that stands for the world of this name; `sim_time_ns` is its time now.
[[nodiscard]] geodesy::GpsTime start_of_world(const void* world, const std::string& name,
                                              std::int64_t sim_time_ns);

/// One receiver in the world of a simulator: settings, schedule, epochs and publishers. The simulator brings
/// time, truth and geometry. For the simulation's thread only.
class HostedReceiver {
 public:
  /// Writes a line to the simulator's console.
  enum class Tone { Warning, Error };
  using Say = std::function<void(Tone tone, const std::string& line)>;
  /// Motion in the world's frame at this instant; empty, with `reason`, if there is none.
  using Truth = std::function<std::optional<TruePose>(std::string& reason)>;

  /// @param settings their warnings are written now
  /// @param sensor_rate_hz of the sensor that carries it; 0: none
  /// Throws InputError, whose text begins with place_name(), as LiveReceiver does and where a stream cannot
  /// be opened.
  HostedReceiver(HostSettings settings, const ReceiverIdentity& identity, const WorldFrame& frame,
                 geodesy::GpsTime start_of_world, double sensor_rate_hz, Say say);
  ~HostedReceiver();
  HostedReceiver(const HostedReceiver&) = delete;
  HostedReceiver& operator=(const HostedReceiver&) = delete;

  [[nodiscard]] const HostSettings& settings() const { return settings_; }
  [[nodiscard]] const WorldFrame& frame() const { return frame_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] double interval_s() const { return schedule_.interval_s(); }

  /// Name of the receiver of the same world whose corrections it takes; empty: of none (HostBases).
  [[nodiscard]] std::string base_elsewhere() const;
  [[nodiscard]] simulation::LiveReceiver& receiver() { return *receiver_; }
  [[nodiscard]] const simulation::LiveReceiver& receiver() const { return *receiver_; }
  /// The epoch of the last finish(), until the next begin(); null: there was none.
  [[nodiscard]] const simulation::LiveReceiver::Step* step() const { return step_ ? &*step_ : nullptr; }
  /// The world's time of the last begin().
  [[nodiscard]] std::int64_t begun_ns() const { return report_.sim_time_ns; }

  void add(std::unique_ptr<EpochPublisher> publisher);
  /// Rays go through this scene, in whose world `own_model` (empty: none) stays invisible.
  void set_scene(std::shared_ptr<WorldScene> scene, std::optional<HostWorld::Id> own_model);
  /// The world's place on the Earth changed: the receiver starts anew there. A scene in the new frame must
  /// follow before the next update. Throws InputError as the constructor.
  void set_frame(const WorldFrame& frame);
  /// Rays of the host's own, and the ranges that it measured in the last epoch for the scan, which end at
  /// `reach_m`.
  void set_tracer(simulation::Tracer tracer, std::function<std::vector<double>()> ranges, double reach_m);
  /// The receiver as requests of options see it at run time, under this name; valid until the next update.
  [[nodiscard]] AdjustableReceiver adjustable(const std::string& name);
  /// Called where the world was reset or went back in time, beside its own reset.
  void on_reset(std::function<void()> action) { on_reset_ = std::move(action); }

  /// Call it in every update of the world with its time. It makes an epoch where one is due. Throws nothing.
  void update(std::int64_t now_ns, const Truth& truth) {
    if (!due(now_ns)) return serve(now_ns);
    begin(now_ns, truth);
    finish();
  }
  /// update() in parts, for hosts that compute epochs beside the simulation. due() is for the simulation's
  /// thread, at any time; where it is true, begin() follows there and asks truth and world, then finish()
  /// once, in any thread, which computes and publishes. Everything else has to wait for finish().
  [[nodiscard]] bool due(std::int64_t now_ns);
  void begin(std::int64_t now_ns, const Truth& truth);
  void finish();
  /// Call it in updates without an epoch, also while the world is paused, but not between begin() and
  /// finish(): publishers serve their lines.
  void serve(std::int64_t now_ns);
  /// Brings the receiver back to the state after construction.
  void reset();
  void say(Tone tone, const std::string& line);  ///< once each

 private:
  void start_receiver();
  void open_streams(const std::string& model);
  void observe(const TruePose& truth, ReceiverReport& report);
  [[nodiscard]] std::vector<double> scan(const Eigen::Vector3d& antenna_enu) const;
  [[nodiscard]] double rate_hz() const;

  HostSettings settings_;
  std::string name_;
  WorldFrame frame_;
  Say say_;
  double sensor_rate_hz_;
  simulation::EpochSchedule schedule_;
  geodesy::GpsTime start_;
  std::shared_ptr<WorldScene> scene_;
  std::optional<HostWorld::Id> own_model_;
  std::uint64_t generation_ = 0;
  bool has_scene_ = false;
  simulation::Tracer tracer_;
  std::function<std::vector<double>()> ranges_;
  double reach_m_ = 0;
  std::function<void()> on_reset_;
  std::optional<simulation::LiveReceiver> receiver_;  // stays at its address: streams refer to it
  std::optional<simulation::LiveReceiver::Step> step_;
  std::vector<std::unique_ptr<EpochPublisher>> publishers_;
  std::int64_t last_ns_ = 0;
  bool went_back_ = false;  // in time, since the last epoch
  ReceiverReport report_;   // of the epoch that is begun
  std::optional<TruePose> truth_;
  std::set<std::string> said_;
};

}  // namespace canyon::adapters
