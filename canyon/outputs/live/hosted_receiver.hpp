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

#include "canyon/base/options/visitor.hpp"
#include "canyon/outputs/live/controls.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"
#include "canyon/outputs/live/rtcm_input.hpp"
#include "canyon/outputs/live/world_scene.hpp"
#include "canyon/run/epoch_schedule.hpp"
#include "canyon/run/run.hpp"
#include "canyon/run/scenario/scenario.hpp"

namespace canyon::live {

/// The settings of one receiver in a host, whatever the host's language is: a scenario, and what each host
/// adds to it. Simulators (HostSettings) and the node of ROS 2 (NodeSettings) add what only they know.
struct HostOptions {
  /// One receiver and, where it takes corrections of another, that as its base.
  simulation::LiveConfig live;
  bool named = false;  ///< `name` stands; where not, the receiver's name is not the user's
  double pose_timeout_s =
      0.5;  ///< age of a pose from outside, in the host's time, after which it is no truth; > 0
  std::vector<std::string> streams;  ///< each FORMAT=ADDRESS (output::parse_stream())
};

/// The fields of every host, but for those of `live`. @param frame_id of its messages; empty: the host's own
/// @param of_pose a host's own fields in the section `pose`
void visit_host(options::Visitor& v, HostOptions& o, std::string& frame_id,
                const std::function<void()>& of_pose = {});

/// A word of a host, such as a topic: a reader throws its fault for blanks in it.
void visit_word(options::Visitor& v, const options::Field& field, std::string& value);

/// What a host says of one receiver before it runs.
struct HostSetup {
  HostOptions options;
  std::string name;        ///< in front of its messages; empty: none
  WorldFrame frame;        ///< of the host's world in the city
  geodesy::GpsTime start;  ///< of the host's time 0, where the options have no start
  double rate_hz = 10;     ///< where the options have none
  bool scan = false;       ///< reports have ranges of rays
  std::int64_t epochs = simulation::EpochSchedule::kEndless;  ///< that a drive has, which ends
  /// The vehicle's sensors from `start` on, for `options.live` that is LiveConfig::with_sensors.
  std::function<simulation::SensorRun()> sensors = {};
  /// Settings, for messages, and texts FORMAT=ADDRESS (output::parse_stream()), open while it lives.
  std::vector<std::pair<std::string, std::string>> streams = {};
  std::string model = {};                  ///< for stream_of_model()
  LinkOpener open_link = {};               ///< of streams with the host's own addresses
  std::vector<std::string> warnings = {};  ///< said at once
  Say say;
  /// Of all receivers of the world; null: of this one.
  std::shared_ptr<SkyWarnings> sky_warnings = {};
  std::shared_ptr<simulation::CityScene> city = {};  ///< null: an open field, until set_scene()
};

/// One receiver in a host: schedule, epochs, corrections, publishers and warnings. The host brings time,
/// truth and geometry. For one thread at a time.
class HostedReceiver {
 public:
  /// The receiver's antenna, and that of its base on the vehicle.
  struct Antennas {
    simulation::Pose receiver;
    std::optional<simulation::Pose> base = {};
  };
  /// The body that carries the antennas, in the world's frame, or these themselves.
  using Motion = std::variant<simulation::RigidPose, Antennas>;
  /// Motion at this instant; empty, with `reason`, if there is none.
  using Truth = std::function<std::optional<Motion>(std::string& reason)>;

  /// Throws InputError, whose text begins with the setup's name, as LiveReceiver does and where a stream
  /// cannot be opened.
  explicit HostedReceiver(HostSetup setup);
  ~HostedReceiver();
  HostedReceiver(const HostedReceiver&) = delete;
  HostedReceiver& operator=(const HostedReceiver&) = delete;

  [[nodiscard]] const WorldFrame& frame() const { return frame_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] double interval_s() const { return schedule_.interval_s(); }

  /// Name of the receiver of the same world whose corrections it takes; empty: of none (HostBases).
  [[nodiscard]] std::string base_elsewhere() const;
  [[nodiscard]] simulation::LiveReceiver& receiver() { return (*run_)[0]; }
  [[nodiscard]] const simulation::LiveReceiver& receiver() const { return (*run_)[0]; }
  /// The epoch of the last finish(), until the next begin(); null: there was none.
  [[nodiscard]] const simulation::LiveReceiver::Step* step() const { return report_.step; }
  /// The world's time of the last begin().
  [[nodiscard]] std::int64_t begun_ns() const { return report_.sim_time_ns; }

  /// @param publisher null: none @param failure in front of what it throws: "cannot publish on ROS 2"; empty:
  /// that ends the host's call
  void add(std::unique_ptr<EpochPublisher> publisher, std::string failure = "an output has failed");
  /// Rays go through this scene, in whose world `own_model` (empty: none) stays invisible.
  void set_scene(std::shared_ptr<WorldScene> scene, std::optional<HostWorld::Id> own_model);
  /// The world's place on the Earth changed: the receiver starts anew there. A scene in the new frame must
  /// follow before the next update. Throws InputError as the constructor.
  void set_frame(const WorldFrame& frame);
  /// Rays of the host's own, and the ranges that it measured in the last epoch for the scan, which end at
  /// `reach_m`.
  void set_tracer(simulation::Tracer tracer, std::function<std::vector<double>()> ranges, double reach_m);
  /// Other options from the next epoch on, as LiveReceiver::set_config(); sky, frame and rate stay.
  void set_config(simulation::LiveConfig config);
  /// The receiver as requests of options see it at run time, under this name; valid until the next update.
  [[nodiscard]] AdjustableReceiver adjustable(const std::string& name);
  /// Called where the world was reset or went back in time, beside its own reset.
  void on_reset(std::function<void()> action) { on_reset_ = std::move(action); }
  /// A message of RTCM 3 that came at `now_ns`, for a receiver whose corrections come by a topic.
  void take_rtcm(std::string_view bytes, std::int64_t now_ns);

  /// Call it in every update of the world with its time. It makes an epoch where one is due. It throws
  /// nothing but what HostSetup::say throws.
  void update(std::int64_t now_ns, const Truth& truth) {
    if (!due(now_ns)) return serve(now_ns);
    begin(now_ns, truth);
    finish();
  }
  /// Instead of update(), for truth that is known for any time: makes every epoch until `now_ns` at its own
  /// instant, in their order. @param truth the motion at an epoch's instant
  void follow(std::int64_t now_ns,
              const std::function<std::optional<Motion>(std::int64_t at_ns, std::string& reason)>& truth);
  /// The instant of follow()'s next epoch; one interval behind the last one where all have been made.
  [[nodiscard]] std::int64_t next_ns() const { return schedule_.next_ns(); }
  /// All HostSetup::epochs have been made.
  [[nodiscard]] bool over() const { return schedule_.over(); }
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
  /// Once each, without passwords. @param of_all it is not of this receiver alone: without its name
  void say(Tone tone, const std::string& line, bool of_all = false);

 private:
  void start_receiver();
  void make_rtcm();
  void say_warnings();
  /// Gives each publisher its work, then says its notes; those that fail end.
  void publish(const std::function<void(EpochPublisher&)>& work);
  void begin_anew();
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
  std::optional<HostWorld::Id> own_model_;
  std::uint64_t generation_ = 0;
  bool has_scene_ = false;
  simulation::Tracer tracer_;
  std::function<std::vector<double>()> ranges_;
  double reach_m_ = 0;
  std::function<void()> on_reset_;
  std::optional<simulation::Run> run_;  // of the receiver, 0, and its base, 1; streams refer to it
  std::optional<RtcmInput> rtcm_;
  std::vector<simulation::LiveReceiver::Step> steps_;  // of the last epoch
  std::string name_;
  Say say_;
  std::set<std::string> said_;
  std::vector<std::pair<std::unique_ptr<EpochPublisher>, std::string>> publishers_;
  std::shared_ptr<SkyWarnings> sky_warnings_;
  std::int64_t last_ns_ = 0;
  bool went_back_ = false;  // in time, since the last epoch
  ReceiverReport report_;   // of the epoch that is begun
  std::optional<Motion> motion_;
};

/// Corrections between the receivers of one world: `corrections.from` of one is the name of another. A base
/// on the same vehicle moves, and gives the vehicle's heading. One elsewhere is a station that states its
/// true place. Not thread-safe.
class HostBases {
 public:
  /// @param vehicle the same for receivers of one vehicle
  void add(HostedReceiver& receiver, std::uint64_t vehicle);
  void remove(const HostedReceiver& receiver);

  /// HostedReceiver::finish() of the receivers that have begun an epoch of one instant, in any thread: each
  /// with the corrections that have come for it, and a base before those that take its corrections.
  void finish(const std::vector<HostedReceiver*>& begun);

 private:
  struct Member {
    HostedReceiver* receiver = nullptr;  // null: removed
    std::uint64_t vehicle = 0;
    std::int64_t last_ns = 0;
  };
  void find_base(std::size_t number);

  std::vector<Member> members_;  // their places are the numbers in `links_`
  simulation::CorrectionLinks links_;
};

}  // namespace canyon::live
