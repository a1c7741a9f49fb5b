#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "canyon/base/options/fwd.hpp"
#include "canyon/outputs/live/controls.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"
#include "canyon/outputs/live/rtcm_input.hpp"
#include "canyon/outputs/live/world_scene.hpp"
#include "canyon/simulation/epoch_schedule.hpp"
#include "canyon/simulation/receiver_group.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::live {

/// The settings of one receiver common to all hosts: a scenario and the host's settings. Simulators
/// (HostSettings) and the ROS 2 node (NodeSettings) add their own.
struct HostOptions {
  /// One receiver and, if it uses corrections of another receiver, that one as its base.
  simulation::RunnerConfig live;
  bool named = false;  ///< `name` is the user's; else the receiver has a default name
  /// Maximum age of an external pose in the host's time; older ones are not used as truth; > 0.
  double pose_timeout_s = 0.5;
  std::vector<std::string> streams;  ///< each FORMAT=ADDRESS (encoding::parse_stream())
};

/// Fields of all hosts except those of `live`. @param frame_id of its messages; empty: the host's default
/// @param pose_context a host's own fields in the section `pose`
void visit_host(options::Visitor& v, HostOptions& o, std::string& frame_id,
                const std::function<void()>& pose_context = {});

/// A text without blanks, such as a topic. A reader throws InputError for blanks.
void visit_word(options::Visitor& v, const options::Field& field, std::string& value);

/// Setup of one receiver by its host.
struct HostSetup {
  HostOptions options;
  std::string name;        ///< prefix of its messages; empty: none
  WorldFrame frame;        ///< of the host's world in the city
  geodesy::GpsTime start;  ///< of the host's time 0, if the options have no start
  double rate_hz = 10;     ///< if the options have none
  bool scan = false;       ///< reports include ranges of rays
  std::int64_t epochs = simulation::EpochSchedule::kEndless;  ///< of a drive with an end
  /// The vehicle's sensors from `start` on, if `options.live` is RunnerConfig::with_sensors.
  std::function<simulation::SensorRun()> sensors = {};
  /// Setting (for messages) and FORMAT=ADDRESS (encoding::parse_stream()) of each stream, open in its
  /// lifetime.
  std::vector<std::pair<std::string, std::string>> streams = {};
  std::string model = {};                  ///< for stream_of_model()
  LinkOpener open_link = {};               ///< for streams with the host's own kinds of address
  std::vector<std::string> warnings = {};  ///< logged at once
  LogFunction log;
  /// Shared by all receivers of the world; null: of this receiver alone.
  std::shared_ptr<SkyWarnings> sky_warnings = {};
  std::shared_ptr<simulation::CityScene> city = {};  ///< null: an open field, until set_scene()
};

/// One receiver in a host: schedule, epochs, corrections, publishers and warnings. The host provides time,
/// truth and geometry. For one thread at a time.
class HostedReceiver {
 public:
  /// The receiver's antenna and its base's antenna on the vehicle.
  struct Antennas {
    simulation::Pose receiver;
    std::optional<simulation::Pose> base = {};
  };
  /// The body with the antennas, or the antennas themselves, in the world's frame.
  using Motion = std::variant<simulation::RigidPose, Antennas>;
  /// Motion at this instant; empty, with `reason`, if there is none.
  using Truth = std::function<std::optional<Motion>(std::string& reason)>;

  /// Throws InputError, whose text begins with the setup's name, as ReceiverRunner does and if a stream
  /// cannot be opened.
  explicit HostedReceiver(HostSetup setup);
  ~HostedReceiver();
  HostedReceiver(const HostedReceiver&) = delete;
  HostedReceiver& operator=(const HostedReceiver&) = delete;

  [[nodiscard]] const WorldFrame& frame() const { return frame_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] double interval_s() const { return schedule_.interval_s(); }

  /// Name of the receiver of the same world whose corrections it uses; empty: none (HostBases).
  [[nodiscard]] std::string base_receiver_name() const;
  [[nodiscard]] simulation::ReceiverRunner& receiver() { return (*run_)[0]; }
  [[nodiscard]] const simulation::ReceiverRunner& receiver() const { return (*run_)[0]; }
  /// The epoch of the last finish(), until the next begin(); null: none.
  [[nodiscard]] const simulation::ReceiverRunner::Step* step() const { return report_.step; }
  /// The world's time of the last begin().
  [[nodiscard]] std::int64_t epoch_start_ns() const { return report_.sim_time_ns; }

  /// @param publisher null: none @param failure prefix of its errors: "cannot publish on ROS 2"; empty: an
  /// error ends the host's call
  void add(std::unique_ptr<EpochPublisher> publisher, std::string failure = "an output has failed");
  /// Traces rays through this scene, in which `vehicle_model` (empty: none) stays invisible.
  void set_scene(std::shared_ptr<WorldScene> scene, std::optional<HostWorld::Id> vehicle_model);
  /// The world's position on the Earth changed: restarts the receiver there. Set a scene in the new frame
  /// before the next update. Throws InputError like the constructor.
  void set_frame(const WorldFrame& frame);
  /// Replaces the ray caster by the host's own. The scan gets the last epoch's ranges, at most `reach_m`.
  void set_tracer(simulation::Tracer tracer, std::function<std::vector<double>()> ranges, double reach_m);
  /// Other options from the next epoch on, like ReceiverRunner::set_config(); sky, frame and rate stay.
  void set_config(simulation::RunnerConfig config);
  /// The receiver under this name for requests that change options at run time; valid until the next update.
  [[nodiscard]] ReceiverHandle receiver_handle(const std::string& name);
  /// Called if the world was reset or its time went back, in addition to the receiver's own reset.
  void on_reset(std::function<void()> action) { on_reset_ = std::move(action); }
  /// Takes an RTCM 3 message received at `now_ns`, for a receiver with corrections from a topic.
  void take_rtcm(std::string_view bytes, std::int64_t now_ns);

  /// Call it in every update of the world with the world's time. Computes an epoch if one is due. Throws only
  /// if HostSetup::log throws.
  void update(std::int64_t now_ns, const Truth& truth) {
    if (!due(now_ns)) return serve(now_ns);
    begin(now_ns, truth);
    finish();
  }
  /// Instead of update(), if the truth is known for any time: computes all epochs until `now_ns` in order,
  /// each at its own instant. @param truth the motion at an epoch's instant
  void follow(std::int64_t now_ns,
              const std::function<std::optional<Motion>(std::int64_t at_ns, std::string& reason)>& truth);
  /// The instant of follow()'s next epoch; one interval after the last one if all have been computed.
  [[nodiscard]] std::int64_t next_ns() const { return schedule_.next_ns(); }
  /// Whether all HostSetup::epochs have been computed.
  [[nodiscard]] bool over() const { return schedule_.over(); }
  /// update() in parts, for hosts that compute epochs in parallel with the simulation. Call due() in the
  /// simulation's thread at any time. If it is true, call begin() there, which reads truth and world, then
  /// finish() once in any thread, which computes and publishes. Any other call must wait for finish().
  [[nodiscard]] bool due(std::int64_t now_ns);
  void begin(std::int64_t now_ns, const Truth& truth);
  void finish();
  /// Lets publishers serve their lines. Call it in updates without an epoch, also if paused, but not between
  /// begin() and finish().
  void serve(std::int64_t now_ns);
  /// Resets the receiver to its state after construction.
  void reset();
  /// Logs each line once, without passwords. @param requested concerns several receivers: no name
  void log(Severity tone, const std::string& line, bool requested = false);

 private:
  void start_receiver();
  void make_rtcm();
  void log_warnings();
  /// Calls each publisher, then logs its notes; removes those that fail.
  void publish(const std::function<void(EpochPublisher&)>& work);
  void reset_state();
  void begin_sensors();
  void compute(const Motion& motion);
  /// The receiver's own options and rate have changed.
  void take_config();
  void follow_scene();
  [[nodiscard]] std::vector<double> scan(const propagation::Arrival& arrival) const;
  [[nodiscard]] geodesy::GpsTime time_of(std::int64_t now_ns) const;
  [[nodiscard]] double rate_hz() const { return options_.live.rate_hz.value_or(default_rate_hz_); }

  HostOptions options_;
  WorldFrame frame_;
  double default_rate_hz_;
  bool scans_;
  std::function<simulation::SensorRun()> make_sensors_;
  std::optional<simulation::SensorRun> sensors_;
  simulation::EpochSchedule schedule_;
  geodesy::GpsTime start_;
  std::shared_ptr<simulation::CityScene> city_;  // null: the scene's, or an open field
  std::shared_ptr<WorldScene> scene_;
  std::optional<HostWorld::Id> vehicle_model_;
  std::uint64_t generation_ = 0;
  bool has_scene_ = false;
  simulation::Tracer tracer_;
  std::function<std::vector<double>()> ranges_;
  double reach_m_ = 0;
  std::function<void()> on_reset_;
  std::optional<simulation::ReceiverGroup> run_;  // of the receiver, 0, and its base, 1; streams refer to it
  std::optional<RtcmInput> rtcm_;
  std::vector<simulation::ReceiverRunner::Step> steps_;  // of the last epoch
  std::string name_;
  LogFunction log_;
  std::set<std::string> logged_;
  std::vector<std::pair<std::unique_ptr<EpochPublisher>, std::string>> publishers_;
  std::shared_ptr<SkyWarnings> sky_warnings_;
  std::int64_t last_ns_ = 0;
  bool went_back_ = false;  // in time, since the last epoch
  ReceiverReport report_;   // of the epoch in progress
  std::optional<Motion> motion_;
};

/// Corrections between the receivers of one world: `corrections.from` of one is the name of another. A base
/// on the same vehicle moves and yields the vehicle's heading. Any other base is a station that reports its
/// true position. Not thread-safe.
class HostBases {
 public:
  /// @param vehicle the same for receivers of one vehicle
  void add(HostedReceiver& receiver, std::uint64_t vehicle);
  void remove(const HostedReceiver& receiver);

  /// Calls HostedReceiver::finish() of all receivers with an epoch in progress at one instant, in any thread:
  /// each with the corrections received for it, a base before the receivers that use its corrections.
  void finish(const std::vector<HostedReceiver*>& started_receivers);

 private:
  struct Member {
    HostedReceiver* receiver = nullptr;  // null: removed
    std::uint64_t vehicle = 0;
    std::int64_t last_ns = 0;
  };
  void find_base(std::size_t number);

  std::vector<Member> members_;  // `links_` refers to their indices
  simulation::CorrectionLinks links_;
};

}  // namespace canyon::live
