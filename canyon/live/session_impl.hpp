#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/secrets.hpp"
#include "canyon/live/epoch_publisher.hpp"
#include "canyon/live/pose_source.hpp"
#include "canyon/live/rtcm_input.hpp"
#include "canyon/live/session.hpp"
#include "canyon/options/values.hpp"
#include "canyon/output/stream.hpp"
#include "canyon/simulation/correction_links.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/epoch_schedule.hpp"
#include "canyon/simulation/motion/pose_motion.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/sensors/sensor_run.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/transport/link.hpp"

namespace canyon::live {

/// The state that commands read and change.
struct CommandContext {
  const simulation::Scenario& scenario;
  std::vector<simulation::LiveReceiver>& receivers;
  const Figures& figures;
  bool changes = false;           ///< may change the simulation
  std::function<double()> now_s;  ///< the scenario's time
};

/// Commands to a running session: one JSON object a line in, one out, {"ok": true, ...} or {"ok": false,
/// "error": ..., "cure": ...} (docs/live.md lists them).
class Commands {
 public:
  virtual ~Commands() = default;
  /// Answers a line; never throws.
  [[nodiscard]] virtual std::string answer(std::string_view line) = 0;
  /// The latest epoch of a receiver, for status requests.
  virtual void keep(const simulation::Epoch& epoch) = 0;
  /// Somebody asked for the end of the run.
  [[nodiscard]] virtual bool stopped() const = 0;
};
/// Answers the lines that come by a link.
[[nodiscard]] std::unique_ptr<Commands> make_commands(CommandContext context,
                                                      std::shared_ptr<transport::Link> link);

// The state of a session: session_setup.cpp makes it, session.cpp runs it.
using geodesy::GpsTime;
using simulation::LiveClock;
using simulation::LiveReceiver;
using Clock = std::chrono::steady_clock;

/// A log whose poses come at their own stamps.
struct Log {
  std::string text;
  std::size_t at = 0;
  /// The next line, or a binary log's next kBinarySize bytes.
  [[nodiscard]] std::string_view next(bool lines) {
    const std::string_view rest = std::string_view(text).substr(at);
    const std::size_t end = lines ? rest.find('\n') : std::string_view::npos;
    const std::string_view piece =
        rest.substr(0, end == std::string_view::npos ? (lines ? rest.size() : kBinarySize) : end + 1);
    at += piece.size();
    return piece;
  }
  [[nodiscard]] bool ended() const { return at == text.size(); }
};

/// A receiver's epochs.
struct Schedule {
  std::size_t receiver = 0;
  simulation::EpochSchedule epochs;
};

/// A source of poses and the receivers on its vehicle.
struct Vehicle {
  std::unique_ptr<PoseSource> source;  ///< null: the trajectory, or receivers that stand still
  std::optional<Log> log;
  std::shared_ptr<transport::Link> link;
  int listener = 0;
  std::vector<Schedule> receivers;
  std::uint64_t asked_at_count = 0;  ///< poses when it was last asked for some
  int silent_s = 0;                  ///< seconds without a pose
  /// Poses as a motion that sensors can feel, where a receiver or an output needs them.
  std::optional<simulation::SmoothPoses> motion = {};
  bool said_sparse = false;

  /// Poses of this instant are needed for an epoch at `at`.
  [[nodiscard]] std::int64_t needs_ns(std::int64_t at) const { return motion ? motion->needs_ns(at) : at; }
  /// The body at an instant; empty, without truth.
  [[nodiscard]] std::optional<simulation::TruePose> body_at(std::int64_t at);
  void pose_came(std::int64_t now_ns) {
    if (motion) motion->follow(source->track(), now_ns);
  }
};

/// One epoch of one receiver that is due.
struct Due {
  std::size_t receiver = 0;
  double host_s = 0;
  std::optional<simulation::AntennaState> antenna;  ///< empty: no truth
  std::optional<Clock::time_point> pose_came;
  LiveReceiver::Step step = {};
  simulation::SensorBatch samples = {};  ///< of the vehicle's sensors since the epoch before
};

/// Corrections of one receiver that come by a stream of RTCM 3.
struct CorrectionInput {
  RtcmInput input;
  std::shared_ptr<transport::Link> caster;  ///< that the receiver reports its place to; null: none
  std::optional<GpsTime> reported;
};

struct Session::Impl {
  Impl(simulation::Scenario s, std::shared_ptr<simulation::CityScene> city)
      : scenario(std::move(s)),
        options(scenario.live.value_or(simulation::LiveOptions{})),
        scene(std::move(city)),
        names(simulation::receiver_names(scenario.receivers)) {
    if (!scene) throw InputError("a live session needs a scene");
    options::check(options, "live.");
    for (auto& receiver : scenario.receivers) {
      if (receiver.fixed) receiver.fixed->settle(scene->city.frame);
    }
    if (options.poses.empty()) options.poses.emplace_back();
    set_time();
    make_receivers();
    make_inputs();
    make_vehicles();
    open_streams();
  }

  void set_time();
  void make_receivers();
  void make_inputs();
  void make_vehicles();
  void open_streams();
  [[nodiscard]] std::shared_ptr<transport::Link> link_of(const std::string& address);
  [[nodiscard]] InputError error(std::string_view problem, std::string_view cure) const {
    return {scenario.file, 0, problem, cure};
  }

  /// Makes what sensors feel, where a receiver, a stream or a sink needs them.
  void begin_sensors();
  /// The samples since the receiver's last epoch, where somebody needs them.
  void take_samples(const Vehicle& vehicle, Due& epoch);
  void begin_clock();
  /// Makes this the run's time.
  void begin_at(std::int64_t run_ns);
  /// With LiveOptions::resume, at a vehicle's pose: moves the run's time to the stamp of the first of all.
  void resume(const Vehicle& vehicle);
  /// A vehicle's sender has begun anew: so does the run. False where other vehicles move.
  bool begin_anew(Vehicle& vehicle);
  [[nodiscard]] bool running() const {
    return (run_options->stop == nullptr || !*run_options->stop) && !(commands && commands->stopped());
  }
  [[nodiscard]] std::int64_t now_ns() const;
  /// The run's time: of the clock, or by stamps that of the latest epoch.
  [[nodiscard]] GpsTime now() const {
    return start + seconds(by_stamps() ? std::max<std::int64_t>(stamped_ns, 0) : now_ns());
  }
  [[nodiscard]] Clock::time_point wall_of(std::int64_t host_ns) const;
  [[nodiscard]] bool by_stamps() const { return options.clock == LiveClock::Stamps; }
  void read_log(Vehicle& vehicle, std::int64_t until_ns);
  [[nodiscard]] bool is_due(Vehicle& vehicle, const simulation::EpochSchedule& epochs, std::int64_t now);
  [[nodiscard]] bool ended(const Vehicle& vehicle) const;
  /// Whether all vehicles that move have ended; without any, whether all have.
  [[nodiscard]] bool ended() const;
  [[nodiscard]] bool stands_still(const Vehicle& vehicle) const {
    return !vehicle.receivers.empty() && scenario.receivers[vehicle.receivers.front().receiver].fixed;
  }
  /// The epochs that are due, each vehicle's in their order, by stamps not more than a block of them: whether
  /// there may be more.
  bool gather(std::int64_t now);
  void gather(Vehicle& vehicle, Schedule& of, std::int64_t now);
  /// The epochs of a receiver's base, and of that base's base, up to an instant.
  void gather_base_of(std::size_t receiver, std::int64_t until_ns);
  void compute_and_write();
  /// Sends a GGA sentence to the NTRIP caster whose corrections the receiver takes.
  void report_place(const simulation::Epoch& epoch);
  void serve();
  void once_a_second();
  /// Serves links and computes what is due; false at the end of the run.
  [[nodiscard]] bool turn();
  void wait() const;
  /// Notes may name addresses: their passwords are hidden.
  void note(const std::string& text) const {
    if (run_options != nullptr && run_options->note) run_options->note(hide_passwords(text));
  }
  void warn(const std::string& text) const {
    const auto& say = run_options->warn ? run_options->warn : run_options->note;
    if (say) say(hide_passwords(text));
  }
  void say_warnings(std::size_t receiver) {
    sky_warnings.take(receivers[receiver], [&](const std::string& line, bool of_sky) {
      warn(of_sky ? line : fmt::format("{}: {}", names[receiver], line));
    });
    if (!inputs[receiver]) return;
    for (const std::string& line : inputs[receiver]->input.take_warnings())
      warn(fmt::format("{}: {}", names[receiver], line));
  }

  simulation::Scenario scenario;
  simulation::LiveOptions options;
  std::shared_ptr<simulation::CityScene> scene;
  std::vector<std::string> names;
  std::unique_ptr<simulation::Simulation> trajectory;  // null: poses come from outside
  GpsTime start;
  simulation::EpochSchedule schedule{1};  // of every receiver, but for its offset
  bool now_starts = false;                // at the next full second
  bool resumed = false;
  std::vector<LiveReceiver> receivers;
  SkyWarnings sky_warnings;
  std::vector<propagation::Propagator> prepared;  // that receivers will ask for
  /// By receiver: the sensors of its vehicle. Empty: it does not need them, or no pose has come.
  std::vector<std::optional<simulation::SensorRun>> sensors;
  std::optional<simulation::CorrectionLinks> corrections;
  std::vector<std::unique_ptr<CorrectionInput>> inputs;  // by receiver; null: none
  std::map<std::string, std::shared_ptr<transport::Link>> links;
  std::vector<Vehicle> vehicles;
  std::vector<std::unique_ptr<output::EncodedStream>> streams;
  std::unique_ptr<Commands> commands;

  // State of a run.
  const RunOptions* run_options = nullptr;
  const std::vector<simulation::EpochSink*>* sinks = nullptr;
  Clock::time_point wall_begin;
  Clock::time_point next_second, next_anew;
  std::vector<Due> due;
  std::int64_t stamped_ns = -1;  // latest instant of a vehicle that poses move
  Figures figures;
};

}  // namespace canyon::live
