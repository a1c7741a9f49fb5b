#include "canyon/outputs/live/session.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <optional>
#include <thread>
#include <utility>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"
#include "canyon/outputs/encoding/nmea.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/outputs/live/controls.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"
#include "canyon/outputs/live/pose_source.hpp"
#include "canyon/outputs/live/rtcm_input.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/epoch_schedule.hpp"
#include "canyon/simulation/motion/smooth_poses.hpp"
#include "canyon/simulation/receiver_group.hpp"
#include "canyon/simulation/sensor_run.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::live {
namespace {

using geodesy::GpsTime;
using simulation::LiveClock;
using simulation::ReceiverRunner;
using Clock = std::chrono::steady_clock;

constexpr std::string_view kTrajectory = "trajectory";
constexpr std::string_view kFile = "file:";

std::int64_t nanoseconds(Clock::duration duration) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(duration).count();
}

/// A log whose poses are replayed at their own stamps.
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

/// Appends samples to `all`.
void add(const simulation::SensorBatch& more, simulation::SensorBatch& all) {
  all.imu_axes = more.imu_axes;
  all.magnetometer_axes = more.magnetometer_axes;
  all.imu.insert(all.imu.end(), more.imu.begin(), more.imu.end());
  all.wheels.insert(all.wheels.end(), more.wheels.begin(), more.wheels.end());
  all.barometer.insert(all.barometer.end(), more.barometer.begin(), more.barometer.end());
  all.magnetometer.insert(all.magnetometer.end(), more.magnetometer.begin(), more.magnetometer.end());
}

/// A receiver's epochs.
struct Schedule {
  std::size_t receiver = 0;
  simulation::EpochSchedule epochs;
};

/// A source of poses and the receivers on its vehicle.
struct Vehicle {
  std::unique_ptr<PoseSource> source;  ///< null: the trajectory, or fixed receivers
  std::optional<Log> log;
  std::shared_ptr<transport::Link> link;
  int listener = 0;
  std::vector<Schedule> receivers;
  std::uint64_t requested_at_count = 0;  ///< number of poses at the last request for poses
  int silent_s = 0;                      ///< seconds without a pose
  /// Poses as smooth motion for sensors, if a receiver or an output needs them.
  std::optional<simulation::SmoothPoses> motion = {};
  bool warned_sparse = false;

  /// The last instant of poses that an epoch at `at` needs.
  [[nodiscard]] std::int64_t needs_ns(std::int64_t at) const { return motion ? motion->needs_ns(at) : at; }
  /// The body at an instant; empty: no truth.
  [[nodiscard]] std::optional<simulation::RigidPose> body_at(std::int64_t at) {
    std::string reason;
    if (!motion) return source->track().at(at, reason);
    motion->reach(source->track(), at);
    if (!motion->holds(at)) return std::nullopt;
    return motion->at(seconds(at));
  }
  void pose_came(std::int64_t now_ns) {
    if (motion) motion->follow(source->track(), now_ns);
  }
};

/// One due epoch of one receiver, the arrival time of its pose, and the samples of its vehicle's sensors
/// since the previous epoch.
struct Due {
  simulation::ReceiverGroup::Due epoch;
  std::optional<Clock::time_point> pose_came = {};
  simulation::SensorBatch samples = {};
};

/// Corrections of one receiver from an RTCM 3 stream.
struct CorrectionInput {
  RtcmInput input;
  std::shared_ptr<transport::Link> caster;  ///< to which the receiver reports its position; null: none
  std::optional<GpsTime> reported;
};

}  // namespace

struct Session::Impl {
  Impl(simulation::Scenario s, std::shared_ptr<simulation::CityScene> city)
      : scenario(std::move(s)),
        options(scenario.live.value_or(simulation::LiveOptions{})),
        scene(std::move(city)),
        names(simulation::receiver_names(scenario.receivers)) {
    if (!scene) throw InputError("a live session needs a scene");
    options::check(options, "live.");
    for (auto& receiver : scenario.receivers)
      if (receiver.fixed) receiver.fixed->resolve(scene->city.frame);
    if (options.poses.empty()) options.poses.emplace_back();
    set_time();
    make_receivers();
    make_inputs();
    make_vehicles();
    open_streams();
  }

  void set_time() {
    const bool moved = std::any_of(options.poses.begin(), options.poses.end(),
                                   [](const auto& source) { return source.from == kTrajectory; });
    const bool has_start = scenario.start || scenario.trajectory.file;
    if (!has_start) {
      const auto utc = std::chrono::system_clock::now().time_since_epoch();
      const auto second = std::chrono::ceil<std::chrono::seconds>(utc);
      scenario.start = geodesy::gps_from_unix(std::chrono::nanoseconds(second).count());
      now_starts = !by_stamps();
    }
    if (moved) {
      simulation::Scenario trajectory_scenario = scenario;
      for (simulation::ReceiverConfig& receiver : trajectory_scenario.receivers)
        if (rtk::is_stream(receiver.options.corrections.from)) receiver.options.corrections.from.clear();
      trajectory = std::make_unique<simulation::Simulation>(std::move(trajectory_scenario), scene);
      start = trajectory->begin();
      schedule = simulation::EpochSchedule(trajectory->interval_s(),
                                           static_cast<std::int64_t>(trajectory->epoch_count()));
    } else {
      if (!scenario.start)
        throw error("'start' is missing", "give the time of the first pose, or leave the trajectory out");
      start = *scenario.start;
      const double interval_s = 1 / scenario.rate_hz.value_or(10);
      schedule = simulation::EpochSchedule(interval_s);
      if (scenario.duration_s) {
        const double count = simulation::EpochSchedule::count_within(*scenario.duration_s, interval_s);
        schedule = simulation::EpochSchedule(interval_s, static_cast<std::int64_t>(count));
      }
    }
    const bool real = std::any_of(options.poses.begin(), options.poses.end(), [](const auto& source) {
      return source.from != kTrajectory && !source.from.starts_with(kFile);
    });
    if (real && by_stamps() && options.poses.size() > 1) {
      throw error("live.clock is stamps, and there are several sources of poses",
                  "use one source with all vehicles' poses in order, or the wall clock");
    }
    if (real && options.speed != 1) {
      throw error(fmt::format("live.speed is {}, but poses arrive in real time", options.speed),
                  "remove it; it is for trajectories and logs");
    }
  }

  void make_receivers() {
    simulation::RunnerConfig config = simulation::live_config(scenario, start, schedule.interval_s());
    config.with_sensors = scenario.sensors.any();
    receivers.emplace(std::move(config), scene, start);
    // Prepared now, so that the first epoch is not late.
    for (std::size_t r = 0; r < receivers->size(); ++r) {
      const ReceiverRunner& receiver = (*receivers)[r];
      prepared.push_back(receiver.environment().make_propagator(receiver.config().receiver().propagation));
    }
  }

  void make_inputs() {
    inputs.resize(names.size());
    for (std::size_t r = 0; r < names.size(); ++r) {
      const std::string& address = scenario.receivers[r].options.corrections.from;
      if (!rtk::is_stream(address)) continue;
      if (address.starts_with(rtk::kTopicAddress)) {
        throw error(fmt::format("receiver '{}' uses corrections from '{}', a ROS 2 topic", names[r], address),
                    "run it as a ROS 2 node (docs/ros2.md), or use a caster, "
                    "ntrip://USER:PASSWORD@HOST:PORT/MOUNT");
      }
      inputs[r] = std::make_unique<CorrectionInput>(
          CorrectionInput{RtcmInput(scenario.receivers[r].options, scenario.seed), nullptr, std::nullopt});
      if (address.starts_with("ntrip://")) inputs[r]->caster = link_of(address);
      (void)link_of(address)->listen([this, r](const transport::Received& received) {
        inputs[r]->input.receive(received.bytes, now());
      });
    }
  }

  void make_vehicles() {
    std::vector<const std::string*> driver(names.size(), nullptr);
    const auto take = [&](Vehicle& vehicle, std::size_t r, const std::string& from) {
      if (scenario.receivers[r].fixed)
        throw error(fmt::format("live.poses: '{}' moves receiver '{}', which is fixed", from, names[r]),
                    "leave one of them out");
      if (driver[r] != nullptr)
        throw error(
            fmt::format("live.poses: '{}' and '{}' both move receiver '{}'", *driver[r], from, names[r]),
            "name each receiver in one source");
      driver[r] = &from;
      const auto n = static_cast<std::int64_t>(names.size());
      const std::int64_t offset_ns =
          options.stagger ? schedule.interval_ns() * static_cast<std::int64_t>(r) / n : 0;
      vehicle.receivers.push_back({r, schedule.lagging(offset_ns)});
    };
    for (const simulation::PoseSourceOptions& source : options.poses) {
      Vehicle& vehicle = vehicles.emplace_back();
      for (const std::string& name : source.receivers) {
        const auto at = std::find(names.begin(), names.end(), name);
        if (at == names.end()) {
          throw error(fmt::format("live.poses: the scenario has no receiver '{}'", name),
                      fmt::format("receivers: {}", fmt::join(names, ", ")));
        }
        take(vehicle, static_cast<std::size_t>(at - names.begin()), source.from);
      }
    }
    for (std::size_t i = 0; i < vehicles.size(); ++i) {
      const simulation::PoseSourceOptions& source = options.poses[i];
      Vehicle& vehicle = vehicles[i];
      if (source.receivers.empty()) {
        for (std::size_t r = 0; r < names.size(); ++r)
          if (driver[r] == nullptr && !scenario.receivers[r].fixed) take(vehicle, r, source.from);
      }
      if (source.from == kTrajectory) continue;
      vehicle.source =
          std::make_unique<PoseSource>(source, scene->city.frame, scene->city.geoid_undulation_m);
      if (source.from.starts_with(kFile)) {
        vehicle.log.emplace();
        vehicle.log->text = read_bytes(source.from.substr(kFile.size()));
        continue;
      }
      const bool shared = std::any_of(options.streams.begin(), options.streams.end(),
                                      [&](const auto& stream) { return stream.address == source.from; });
      if (source.from.starts_with("udp://") && !shared && vehicle.source->request().empty()) {
        throw error(
            fmt::format("live.poses: '{}' is an address to send to, not to receive poses from", source.from),
            "write udp-listen://127.0.0.1:PORT, and send the poses to that port");
      }
      vehicle.link = link_of(source.from);
      vehicle.listener = vehicle.link->listen([this, i](const transport::Received& received) {
        Vehicle& self = vehicles[i];
        if (!by_stamps()) {
          self.source->receive(received, now_ns(), [&] {
            resume(self);
            self.pose_came(now_ns());
          });
          return;
        }
        self.source->receive_log(
            received, options.resume,
            [&](std::int64_t now) {
              resume(self);
              self.pose_came(now);
              for (bool more = true; more && running();) {
                more = gather(now);
                compute_and_write();
              }
            },
            [&] { return reset_state(self); });
      });
    }
    for (std::size_t r = 0; r < names.size(); ++r) {
      if (driver[r] != nullptr) continue;
      if (scenario.receivers[r].fixed) {
        vehicles.emplace_back().receivers.push_back({r, schedule});
        continue;
      }
      throw error(fmt::format("live.poses: no source moves receiver '{}'", names[r]),
                  "name it in a source, or add a source without 'receivers'");
    }
  }

  void open_streams() {
    for (std::size_t i = 0; i < options.streams.size(); ++i) {
      const simulation::StreamRequest& request = options.streams[i];
      try {
        const std::size_t r = encoding::find_receiver(request, names);
        const simulation::BuiltSky& sky = (*receivers)[r].sky();
        encoding::ReceiverDescription description = encoding::describe_receiver(
            scenario.receivers[r], *sky.sky, sky.navigation, start, schedule.interval_s());
        description.sensors = simulation::sensors_of(scenario, r);
        streams.push_back(encoding::open_stream(request, r, description, link_of(request.address)));
      } catch (const InputError& e) {
        if (!e.file().empty()) throw;
        throw InputError(fmt::format("stream {}: {}", i + 1, e.problem()), e.hint());
      }
    }
    if (options.control.empty()) return;
    CommandContext context{std::filesystem::absolute(scenario.file), {}, metrics, options.changes, [this] {
                             return seconds(now_ns());
                           }};
    for (std::size_t r = 0; r < names.size(); ++r)
      context.receivers.push_back({names[r], &(*receivers)[r], {}, nullptr, false});
    commands = make_commands(std::move(context), link_of(options.control));
  }

  [[nodiscard]] std::shared_ptr<transport::Link> link_of(const std::string& address) {
    std::shared_ptr<transport::Link>& link = links[address];
    if (!link) link = std::make_shared<transport::Link>(address);
    return link;
  }

  [[nodiscard]] InputError error(std::string_view problem, std::string_view hint) const {
    return {scenario.file, 0, problem, hint};
  }

  /// Makes the motion for sensors if a receiver, a stream or a sink needs them.
  void begin_sensors() {
    sensors.clear();
    sensors.resize(names.size());
    sensed.clear();
    sensed.resize(names.size());
    if (!scenario.sensors.any()) return;
    const bool written = std::any_of(sinks->begin(), sinks->end(),
                                     [](const simulation::EpochSink* sink) { return sink->uses_sensors(); });
    const auto needs = [&](std::size_t r) {
      return written || (*receivers)[r].config().receiver().options.dead_reckoning.enabled ||
             sends_samples(r);
    };
    for (Vehicle& vehicle : vehicles) {
      if (has_stopped(vehicle)) continue;
      for (const Schedule& each : vehicle.receivers) {
        if (!needs(each.receiver)) continue;
        if (!vehicle.source) {
          sensors[each.receiver].emplace(trajectory->sensors());
        } else {
          constexpr double kMin_s = 0.04;
          vehicle.motion.emplace(scene->city.frame,
                                 std::max(kMin_s, vehicle.source->options().track.smoothing_s));
        }
      }
    }
  }

  [[nodiscard]] bool sends_samples(std::size_t receiver) const {
    return std::any_of(streams.begin(), streams.end(), [receiver](const auto& stream) {
      return stream->receiver() == receiver && stream->uses_sensors();
    });
  }

  /// Sends samples that have ended at an instant to streams at once, in real time; stores them for epochs.
  void sample_sensors(const Vehicle& vehicle, std::size_t receiver, std::int64_t until_ns) {
    auto& run = sensors[receiver];
    if (vehicle.motion) {
      const simulation::SmoothPoses& motion = *vehicle.motion;
      if (!run) {
        run.emplace(
            scenario.sensors, scenario.seed, start,
            [this, &motion](GpsTime t) { return motion.ecef_at(t - start); },
            [this, &motion](GpsTime t) { return motion.pose_at(t - start, t); },
            scene->city.geoid_undulation_m);
      }
      run->skip(start + motion.begin_s());
    }
    if (!run) return;
    const simulation::SensorBatch& batch = run->until(start + seconds(until_ns));
    add(batch, sensed[receiver]);
    if (by_stamps()) return;
    for (const auto& stream : streams)
      if (stream->receiver() == receiver) stream->write_samples(batch);
  }
  /// Does the same between epochs.
  void sample_sensors(std::int64_t now) {
    if (by_stamps() || !scenario.sensors.any()) return;
    for (Vehicle& vehicle : vehicles) {
      for (const Schedule& each : vehicle.receivers) {
        if (each.epochs.over() || !sends_samples(each.receiver)) continue;
        std::int64_t until = std::min(now, each.epochs.next_ns());
        if (vehicle.log) read_log(vehicle, vehicle.needs_ns(until));
        // The motion is known up to some steps before the last pose.
        for (int step = 0; vehicle.motion && step < 20 && !vehicle.motion->holds(until); ++step)
          until -= std::llround(vehicle.motion->step_s() * 1e9);
        if (!vehicle.source || (vehicle.motion && vehicle.motion->holds(until)))
          sample_sensors(vehicle, each.receiver, until);
      }
    }
  }

  void begin_clock() {
    wall_begin = Clock::now();
    if (now_starts) {
      const auto utc = std::chrono::system_clock::now().time_since_epoch();
      const double ahead_s =
          start - geodesy::gps_from_unix(std::chrono::duration_cast<std::chrono::nanoseconds>(utc).count());
      // The scenario's start may have passed while the city was read.
      wall_begin += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(ahead_s));
      const auto late = static_cast<std::int64_t>(std::ceil(-ahead_s / schedule.interval_s()));
      for (Vehicle& vehicle : vehicles)
        for (Schedule& each : vehicle.receivers) each.epochs.go_to(late);
    }
    next_second = Clock::now() + std::chrono::seconds(1);
  }

  /// Sets the run's time.
  void begin_at(std::int64_t run_ns) {
    if (!by_stamps()) wall_begin += Clock::now() - wall_of(run_ns);
    for (Vehicle& vehicle : vehicles)
      for (Schedule& each : vehicle.receivers) each.epochs.begin_at(run_ns);
  }

  /// With LiveOptions::resume: sets the run's time to the stamp of the first pose of all vehicles.
  void resume(const Vehicle& vehicle) {
    const std::optional<double> stamp_s = vehicle.source->last_stamp_s();
    if (!options.resume || !stamp_s || std::exchange(resumed, true)) return;
    constexpr double kMax_s = 1e9;  // beyond, stamps are dates
    if (!(*stamp_s >= 0 && *stamp_s < kMax_s)) {
      note(fmt::format(
          "live.resume has no effect: a pose's timestamp of {:.0f} s cannot be the time of a run", *stamp_s));
      return;
    }
    begin_at(std::llround(*stamp_s * 1e9));
    note(fmt::format("the run's time is {:.1f} s ({}), from the first pose's timestamp", *stamp_s,
                     geodesy::format_gpst(start + *stamp_s, 1)));
  }

  /// Restarts the run after a restart of a vehicle's sender. False if other vehicles move.
  bool reset_state(Vehicle& vehicle) {
    if (options.poses.size() > 1) return false;
    compute_and_write();
    if (Clock::now() >= next_reset) {
      warn(fmt::format("poses from {}: timestamps jumped to another clock; restarting the run at {}",
                       vehicle.source->options().from, geodesy::format_gpst(start, 0)));
      next_reset = Clock::now() + std::chrono::seconds(1);
    }
    begin_at(0);
    resumed = false;
    stamped_ns = -1;
    if (vehicle.motion) vehicle.motion.emplace(scene->city.frame, vehicle.motion->step_s());
    receivers->restart();
    for (std::size_t r = 0; r < names.size(); ++r) {
      sensors[r].reset();
      sensed[r] = {};
      if (!inputs[r]) continue;
      inputs[r]->reported.reset();
      inputs[r]->input.reset_state();
    }
    return true;
  }

  [[nodiscard]] bool running() const {
    return (run_options->stop == nullptr || !*run_options->stop) && !(commands && commands->stopped());
  }
  [[nodiscard]] std::int64_t now_ns() const {
    const std::int64_t wall_ns = nanoseconds(Clock::now() - wall_begin);
    return options.speed == 1 ? wall_ns
                              : static_cast<std::int64_t>(static_cast<double>(wall_ns) * options.speed);
  }

  /// The run's time: from the clock or, with stamps, from the latest epoch.
  [[nodiscard]] GpsTime now() const {
    return start + seconds(by_stamps() ? std::max<std::int64_t>(stamped_ns, 0) : now_ns());
  }
  [[nodiscard]] Clock::time_point wall_of(std::int64_t host_ns) const {
    return wall_begin +
           std::chrono::nanoseconds(static_cast<std::int64_t>(static_cast<double>(host_ns) / options.speed));
  }

  [[nodiscard]] bool by_stamps() const { return options.clock == LiveClock::Stamps; }
  void read_log(Vehicle& vehicle, std::int64_t until_ns) {
    Log& log = *vehicle.log;
    const bool lines = vehicle.source->options().format == simulation::PoseFormat::Json;
    bool restarted = false;  // later data are of a time after until_ns
    while (!restarted && !log.ended() && !vehicle.source->track().reaches(until_ns)) {
      vehicle.source->receive_log(
          {0, std::string(log.next(lines)), lines}, false,
          [&](std::int64_t now_ns) { vehicle.pose_came(now_ns); },
          [&] { return restarted = reset_state(vehicle); });
    }
  }

  [[nodiscard]] bool is_due(Vehicle& vehicle, const simulation::EpochSchedule& epochs, std::int64_t now) {
    const std::int64_t at = epochs.next_ns();
    if (epochs.over() || (!by_stamps() && now < at)) return false;
    if (!vehicle.source) {
      // With stamps, fixed receivers follow the receivers with poses.
      const bool along = by_stamps() && has_stopped(vehicle) &&
                         std::any_of(vehicles.begin(), vehicles.end(),
                                     [](const Vehicle& other) { return other.source != nullptr; });
      return !along || at <= stamped_ns;
    }
    const std::int64_t needed = vehicle.needs_ns(at);
    if (vehicle.log) {
      read_log(vehicle, needed);
      return vehicle.source->track().reaches(vehicle.log->ended() ? at : needed);
    }
    if (vehicle.source->track().reaches(needed)) return true;
    return !by_stamps() && seconds(now - needed) >= options.wait_s;
  }

  [[nodiscard]] bool ended(const Vehicle& vehicle) const {
    const auto all = [&](auto&& holds) {
      return std::all_of(vehicle.receivers.begin(), vehicle.receivers.end(), holds);
    };
    if (all([](const Schedule& each) { return each.epochs.over(); })) return true;
    if (vehicle.log) {
      return vehicle.log->ended() && all([&](const Schedule& each) {
               return each.epochs.over() || !vehicle.source->track().reaches(each.epochs.next_ns());
             });
    }
    return vehicle.link && vehicle.link->transport().ended() && by_stamps();
  }

  /// Whether all moving vehicles have ended or, if none moves, all vehicles.
  [[nodiscard]] bool ended() const {
    const bool moving = !std::all_of(vehicles.begin(), vehicles.end(),
                                     [this](const Vehicle& vehicle) { return has_stopped(vehicle); });
    return std::all_of(vehicles.begin(), vehicles.end(), [&](const Vehicle& vehicle) {
      return (moving && has_stopped(vehicle)) || ended(vehicle);
    });
  }

  [[nodiscard]] bool has_stopped(const Vehicle& vehicle) const {
    return !vehicle.receivers.empty() && scenario.receivers[vehicle.receivers.front().receiver].fixed;
  }
  /// Collects the due epochs, in order for each vehicle, with stamps at most one block. Returns whether there
  /// may be more.
  bool gather(std::int64_t now) {
    constexpr std::size_t kBlock = 256;
    bool more = false;
    for (Vehicle& vehicle : vehicles) {
      // In real time, one epoch per pass: links and other receivers are served before the next.
      const std::size_t maximum = by_stamps() ? kBlock : vehicle.receivers.size();
      for (std::size_t taken = 0; taken < maximum; ++taken) {
        const auto next = std::min_element(
            vehicle.receivers.begin(), vehicle.receivers.end(), [](const Schedule& a, const Schedule& b) {
              return !a.epochs.over() && (b.epochs.over() || a.epochs.next_ns() < b.epochs.next_ns());
            });
        if (next == vehicle.receivers.end() || !is_due(vehicle, next->epochs, now)) break;
        gather(vehicle, *next, now);
        more = more || taken + 1 == kBlock;
      }
    }
    return more;
  }

  void gather(Vehicle& vehicle, Schedule& of, std::int64_t now) {
    // Epochs delayed by more than this are skipped.
    constexpr double kLatest_s = 1;
    if (!by_stamps() && !vehicle.log && vehicle.source &&
        seconds(now - vehicle.needs_ns(of.epochs.next_ns())) > kLatest_s)
      metrics.missed += static_cast<std::uint64_t>(of.epochs.catch_up(now));
    if (vehicle.log)
      read_log(vehicle, vehicle.needs_ns(of.epochs.next_ns()));  // a base's log may not have been read yet
    const std::int64_t at = of.epochs.take();
    const std::size_t r = of.receiver;
    gather_base_of(r, at);
    if (vehicle.source) stamped_ns = std::max(stamped_ns, at);
    const GpsTime time = start + seconds(at);
    Due next{{r, time}};
    simulation::ReceiverGroup::Due& epoch = next.epoch;
    epoch.antenna = receivers->fixed_pose(r, time);
    epoch.inputs.continuous = !vehicle.source;
    bool moves = !vehicle.source;
    if (vehicle.source) {
      const std::optional<simulation::RigidPose> body = vehicle.body_at(at);
      moves = body.has_value();
      const auto arrival = vehicle.source->track().last_arrival_ns();
      if (body && arrival && !by_stamps()) next.pose_came = wall_of(std::max(*arrival, at));
      if (body) {
        epoch.antenna =
            simulation::pose_of(*body, {scene->city.frame}, time, scenario.receivers[r].lever_arm_m);
      }
      // Between two poses and after the last one the motion is not bounded.
      if (epoch.antenna && !simulation::is_possible(*epoch.antenna, scene->city.frame)) epoch.antenna.reset();
    } else if (!epoch.antenna) {
      epoch.antenna = trajectory->antenna_pose(r, time);
    }
    if (moves) {
      sample_sensors(vehicle, r, at);
      next.samples = std::exchange(sensed[r], {});
    }
    if (inputs[r]) epoch.corrections = inputs[r]->input.take(time);
    due.push_back(std::move(next));
  }

  /// Takes the epochs of a receiver's base, and of the base's own base, up to an instant.
  void gather_base_of(std::size_t receiver, std::int64_t until_ns) {
    const std::optional<std::size_t> base = receivers->base_of(receiver);
    if (!base) return;
    for (Vehicle& vehicle : vehicles) {
      for (Schedule& each : vehicle.receivers) {
        if (each.receiver != *base) continue;
        while (!each.epochs.over() && each.epochs.next_ns() <= until_ns) gather(vehicle, each, until_ns);
      }
    }
  }

  void compute_and_write() {
    // Writing to a stream may receive poses by its link.
    std::vector<Due> block = std::exchange(due, {});
    if (block.empty()) return;
    // A receiver may have several due epochs; epochs of different receivers are computed in parallel.
    std::stable_sort(block.begin(), block.end(),
                     [](const Due& a, const Due& b) { return a.epoch.time < b.epoch.time; });
    // Limits the epochs computed before the first is written: an epoch takes some 150 kB.
    constexpr std::size_t kTogether = 32;
    for (std::span<Due> rest(block); !rest.empty(); rest = rest.subspan(std::min(kTogether, rest.size())))
      compute_and_write(rest.first(std::min(kTogether, rest.size())));
  }

  void compute_and_write(std::span<Due> block) {
    std::vector<simulation::ReceiverGroup::Due> epochs;
    epochs.reserve(block.size());
    for (Due& each : block) {
      if (sensors[each.epoch.receiver]) each.epoch.inputs.sensors = &each.samples;
      epochs.push_back(each.epoch);
    }
    const std::vector<ReceiverRunner::Step> steps = receivers->make(epochs, true);
    for (std::size_t i = 0; i < block.size(); ++i) {
      const simulation::Epoch& out = steps[i].epoch;
      ++metrics.epochs;
      metrics.host_s = out.truth.time - start;
      if (out.observed.fix.solved()) ++metrics.fixes;
      if (!out.observed.fix.solved()) {
        metrics.no_fix = fmt::format("{}: {}", names[out.receiver],
                                     encoding::no_fix_reason(out.observed.fix, out.containment));
      } else if (metrics.no_fix.starts_with(names[out.receiver] + ": ")) {
        metrics.no_fix.clear();
      }
      if (!epochs[i].antenna) ++metrics.no_truth;
      for (const auto& stream : streams) stream->write(out);
      report_position(out);
      for (simulation::EpochSink* sink : *sinks) sink->write(out);
      if (commands) commands->keep(out);
      if (const auto& came = block[i].pose_came)
        metrics.latency.add(std::chrono::duration<double>(Clock::now() - *came).count());
      log_warnings(out.receiver);
    }
  }

  /// Sends a GGA sentence to the NTRIP caster whose corrections the receiver uses.
  void report_position(const simulation::Epoch& epoch) {
    constexpr double kReportEvery_s = 10;
    const auto& input = inputs[epoch.receiver];
    if (!input) return;
    input->input.set_position(epoch.truth_ecef);
    if (!input->caster || !epoch.observed.fix.solved()) return;
    if (input->reported && epoch.observed.time - *input->reported < kReportEvery_s) return;
    input->reported = epoch.observed.time;
    input->caster->transport().send(encoding::nmea_gga(epoch));
  }

  /// Serves all links each 10 ms; wait() serves links with input.
  void serve() {
    if (Clock::now() >= next_service) {
      next_service = Clock::now() + std::chrono::milliseconds(10);
      for (const auto& [address, link] : links) link->serve();
    }
    for (const auto& stream : streams) {
      stream->send_due();
      const std::string line = encoding::apply_commands(*stream, (*receivers)[stream->receiver()]);
      if (!line.empty()) note(fmt::format("{}: {}", names[stream->receiver()], line));
    }
  }

  void once_a_second() {
    if (Clock::now() < next_second) return;
    next_second += std::chrono::seconds(1);
    metrics.poses = 0;
    for (Vehicle& vehicle : vehicles) {
      if (!vehicle.source) continue;
      metrics.poses += vehicle.source->count();
      for (const std::string& line : vehicle.source->take_notes())
        note(fmt::format("poses from {}: {}", vehicle.source->options().from, line));
      if (const auto sparse_s = vehicle.motion ? vehicle.motion->sparse_s() : std::nullopt;
          sparse_s && !std::exchange(vehicle.warned_sparse, true)) {
        note(fmt::format(
            "poses from {}: the interval is {:.2f} s, and sensors get straight motion between two poses: set "
            "smoothing_s to the interval, or send more",
            vehicle.source->options().from, *sparse_s));
      }
      const bool silent =
          std::exchange(vehicle.requested_at_count, vehicle.source->count()) == vehicle.source->count();
      vehicle.silent_s = silent ? vehicle.silent_s + 1 : 0;
      if (constexpr int kLong_s = 5; vehicle.link && vehicle.silent_s == kLong_s) {
        note(fmt::format("poses from {}: none received {}", vehicle.source->options().from,
                         vehicle.source->count() == 0 ? "yet: check the address and the sender"
                                                      : fmt::format("for {} s", kLong_s)));
      }
      if (!silent) continue;
      if (const std::string request = vehicle.source->request(); vehicle.link && !request.empty())
        vehicle.link->transport().send(request);
    }
    for (const auto& [address, link] : links)
      for (const std::string& line : link->take_notes()) note(fmt::format("{}: {}", address, line));
    if (run_options->progress) run_options->progress(metrics);
  }

  /// Serves links and computes due epochs; false at the end of the run.
  [[nodiscard]] bool next_round() {
    round_start = Clock::now();
    serve();
    gather(now_ns());
    compute_and_write();
    sample_sensors(now_ns());
    once_a_second();
    return !ended();
  }

  void wait() {
    // Maximum wait, so that servers accept clients and drivers get their responses.
    Clock::time_point until = Clock::now() + std::chrono::milliseconds(20);
    for (const Vehicle& vehicle : vehicles) {
      if (by_stamps() && !vehicle.link && !ended(vehicle)) return;
      if (by_stamps()) continue;
      for (const Schedule& each : vehicle.receivers) {
        if (each.epochs.over()) continue;
        const Clock::time_point at = wall_of(vehicle.needs_ns(each.epochs.next_ns()));
        // After its instant, an epoch waits for a pose or for the end of wait_s.
        const auto patience =
            std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options.wait_s));
        until = std::min(until, at > Clock::now() ? at : at + patience);
        if (sensors[each.receiver] && sends_samples(each.receiver))
          until = std::min(until, Clock::now() + std::chrono::milliseconds(5));  // the next sample may end
      }
    }
    for (const auto& stream : streams)
      if (const auto next = stream->next_due()) until = std::min(until, *next);
    // A pass takes some microseconds for each link; input during it is handled together in the next pass.
    std::this_thread::sleep_until(std::min(
        until, round_start + std::chrono::microseconds(10 * static_cast<std::int64_t>(links.size()))));
    std::vector<int> handles;
    std::vector<pollfd> polled;
    std::vector<transport::Link*> of;
    for (const auto& [address, link] : links) {
      handles.clear();
      link->transport().add_handles(handles);
      for (const int handle : handles) polled.push_back({handle, POLLIN, 0});
      of.resize(polled.size(), link.get());
    }
    const auto left = std::max<std::int64_t>(0, nanoseconds(until - Clock::now()));
    const timespec timeout{static_cast<time_t>(left / 1'000'000'000),
                           static_cast<long>(left % 1'000'000'000)};
    if (ppoll(polled.data(), polled.size(), &timeout, nullptr) <= 0) return;
    for (std::size_t i = 0; i < polled.size(); ++i)
      if (polled[i].revents != 0) of[i]->serve();
  }

  /// Notes may name addresses: their passwords are hidden.
  void note(const std::string& text) const {
    if (run_options != nullptr && run_options->note) run_options->note(hide_passwords(text));
  }
  void warn(const std::string& text) const {
    const auto& log_line = run_options->warn ? run_options->warn : run_options->note;
    if (log_line) log_line(hide_passwords(text));
  }
  void log_warnings(std::size_t receiver) {
    sky_warnings.take((*receivers)[receiver], [&](const std::string& line, bool is_sky_warning) {
      warn(is_sky_warning ? line : fmt::format("{}: {}", names[receiver], line));
    });
    if (!inputs[receiver]) return;
    for (const std::string& line : inputs[receiver]->input.take_warnings())
      warn(fmt::format("{}: {}", names[receiver], line));
  }

  simulation::Scenario scenario;
  simulation::LiveOptions options;
  std::shared_ptr<simulation::CityScene> scene;
  std::vector<std::string> names;
  std::unique_ptr<simulation::Simulation> trajectory;  // null: poses are external
  GpsTime start;
  simulation::EpochSchedule schedule{1};  // of every receiver, without its offset
  bool now_starts = false;                // at the next full second
  bool resumed = false;
  std::optional<simulation::ReceiverGroup> receivers;
  SkyWarnings sky_warnings;
  std::vector<propagation::Propagator> prepared;  // that receivers will need
  /// By receiver: the sensors of its vehicle. Empty: not needed, or no pose received.
  std::vector<std::optional<simulation::SensorRun>> sensors;
  std::vector<simulation::SensorBatch> sensed;           // their samples since the receiver's last epoch
  std::vector<std::unique_ptr<CorrectionInput>> inputs;  // by receiver; null: none
  std::map<std::string, std::shared_ptr<transport::Link>> links;
  std::vector<Vehicle> vehicles;
  std::vector<std::unique_ptr<encoding::EncodedStream>> streams;
  std::unique_ptr<Commands> commands;

  // State of a run.
  const SessionOptions* run_options = nullptr;
  const std::vector<simulation::EpochSink*>* sinks = nullptr;
  Clock::time_point wall_begin;
  Clock::time_point next_second, next_reset, next_service, round_start;
  std::vector<Due> due;
  std::int64_t stamped_ns = -1;  // latest instant of a vehicle moved by poses
  SessionMetrics metrics;
};

Session::Session(simulation::Scenario scenario, std::shared_ptr<simulation::CityScene> scene)
    : impl_(std::make_unique<Impl>(std::move(scenario), std::move(scene))) {}
Session::~Session() = default;

geodesy::GpsTime Session::start() const {
  return impl_->start;
}
double Session::interval_s() const {
  return impl_->schedule.interval_s();
}
const simulation::Scenario& Session::scenario() const {
  return impl_->scenario;
}

SessionMetrics Session::run(const std::vector<simulation::EpochSink*>& sinks, const SessionOptions& options) {
  Impl& impl = *impl_;
  impl.run_options = &options;
  impl.sinks = &sinks;
  impl.metrics = {};
  impl.begin_sensors();
  impl.begin_clock();
  for (std::size_t r = 0; r < impl.names.size(); ++r) impl.log_warnings(r);
  for (const auto& [address, link] : impl.links)
    for (const std::string& line : link->take_notes()) impl.note(fmt::format("{}: {}", address, line));
  std::exception_ptr failure;
  const auto finish = [&](const auto& end) {
    try {
      end();
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  };
  // Epochs until then are kept, also if an error ends the run.
  finish([&] {
    while (impl.running() && impl.next_round()) impl.wait();
  });
  for (const auto& stream : impl.streams) finish([&] { stream->finish(); });
  finish([&] { simulation::finish_sinks(sinks, nullptr, nullptr); });
  impl.next_second = {};
  finish([&] { impl.once_a_second(); });
  // A link shared by poses and streams ends here.
  for (Vehicle& vehicle : impl.vehicles) {
    if (const std::uint64_t n = vehicle.source ? vehicle.source->foreign_clock_count() : 0; n > 0) {
      impl.warn(fmt::format(
          "poses from {}: {} {} dropped: their timestamps jump to another clock, and with several "
          "sources the run cannot restart; split the log, or run it alone",
          vehicle.source->options().from, n, n == 1 ? "pose was" : "poses were"));
    }
    if (vehicle.link) finish([&] { vehicle.link->finish(vehicle.listener, {}); });
  }
  if (failure) std::rethrow_exception(failure);
  return impl.metrics;
}

}  // namespace canyon::live
