#include "canyon/outputs/live/vehicle_feed.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <string_view>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/outputs/live/pose_source.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/motion/smooth_poses.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::live {
namespace {

using geodesy::GpsTime;
using Wall = SessionClock::Wall;

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

}  // namespace

/// A receiver's epochs.
struct VehicleFeed::Schedule {
  std::size_t receiver = 0;
  simulation::EpochSchedule epochs;
};

/// A source of poses and the receivers on its vehicle.
struct VehicleFeed::Vehicle {
  std::unique_ptr<PoseSource> source;  ///< null: the trajectory, or fixed receivers
  std::optional<Log> log;
  std::shared_ptr<transport::Link> link;
  int listener = 0;
  bool fixed = false;  ///< it has one receiver, with a fixed position
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

VehicleFeed::VehicleFeed(SessionParts session)
    : session_(std::move(session)),
      vehicles_(session_.options.poses.size()),
      sensors_(session_.scenario.receivers.size()),
      sensed_(sensors_.size()) {
  const simulation::Scenario& scenario = session_.scenario;
  const std::vector<std::string> names = simulation::receiver_names(scenario.receivers);
  const simulation::EpochSchedule& schedule = session_.clock.schedule();
  std::vector<const std::string*> driver(names.size(), nullptr);
  const auto error = [&](std::string_view problem, std::string_view hint) {
    return InputError(scenario.file, 0, problem, hint);
  };
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
        session_.options.stagger ? schedule.interval_ns() * static_cast<std::int64_t>(r) / n : 0;
    vehicle.receivers.push_back({r, schedule.lagging(offset_ns)});
  };
  for (std::size_t i = 0; i < vehicles_.size(); ++i) {
    const simulation::PoseSourceOptions& source = session_.options.poses[i];
    for (const std::string& name : source.receivers) {
      const auto at = std::find(names.begin(), names.end(), name);
      if (at == names.end()) {
        throw error(fmt::format("live.poses: the scenario has no receiver '{}'", name),
                    fmt::format("receivers: {}", fmt::join(names, ", ")));
      }
      take(vehicles_[i], static_cast<std::size_t>(at - names.begin()), source.from);
    }
  }
  for (std::size_t i = 0; i < session_.options.poses.size(); ++i) {
    const simulation::PoseSourceOptions& source = session_.options.poses[i];
    for (std::size_t r = 0; source.receivers.empty() && r < names.size(); ++r)
      if (driver[r] == nullptr && !scenario.receivers[r].fixed) take(vehicles_[i], r, source.from);
    if (!source.is_trajectory()) open(i);
  }
  for (std::size_t r = 0; r < names.size(); ++r) {
    if (driver[r] != nullptr) continue;
    if (!scenario.receivers[r].fixed) {
      throw error(fmt::format("live.poses: no source moves receiver '{}'", names[r]),
                  "name it in a source, or add a source without 'receivers'");
    }
    Vehicle& vehicle = vehicles_.emplace_back();
    vehicle.receivers.push_back({r, schedule});
    vehicle.fixed = true;
  }
}

VehicleFeed::~VehicleFeed() = default;

void VehicleFeed::open(std::size_t index) {
  const simulation::PoseSourceOptions& source = session_.options.poses[index];
  Vehicle& vehicle = vehicles_[index];
  const city::City& city = session_.scene.city;
  vehicle.source = std::make_unique<PoseSource>(source, city.frame, city.geoid_undulation_m);
  if (transport::is_file_address(source.from)) {
    vehicle.log.emplace().text = read_bytes(source.from.substr(std::string_view("file:").size()));
    return;
  }
  const auto& streams = session_.options.streams;
  const bool shared = std::any_of(streams.begin(), streams.end(),
                                  [&](const auto& stream) { return stream.address == source.from; });
  if (source.from.starts_with("udp://") && !shared && vehicle.source->request().empty()) {
    throw InputError(
        session_.scenario.file, 0,
        fmt::format("live.poses: '{}' is an address to send to, not to receive poses from", source.from),
        "write udp-listen://127.0.0.1:PORT, and send the poses to that port");
  }
  vehicle.link = transport::link_of(session_.links, source.from);
  vehicle.listener = vehicle.link->listen(
      [this, index](const transport::Received& received) { receive(vehicles_[index], received); });
}

void VehicleFeed::receive(Vehicle& vehicle, const transport::Received& received) {
  const SessionClock& clock = session_.clock;
  if (!clock.by_stamps()) {
    vehicle.source->receive(received, clock.now_ns(), [&] {
      resume(vehicle);
      vehicle.pose_came(clock.now_ns());
    });
    return;
  }
  vehicle.source->receive_log(
      received, session_.options.resume,
      [&](std::int64_t now_ns) {
        resume(vehicle);
        vehicle.pose_came(now_ns);
        session_.pose_came(now_ns);
      },
      [&] { return reset_state(vehicle); });
}

void VehicleFeed::read_log(Vehicle& vehicle, std::int64_t until_ns) {
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

void VehicleFeed::go_to(std::int64_t epoch) {
  for (Vehicle& vehicle : vehicles_)
    for (Schedule& each : vehicle.receivers) each.epochs.go_to(epoch);
}

void VehicleFeed::begin(bool written) {
  std::fill(sensors_.begin(), sensors_.end(), std::nullopt);
  std::fill(sensed_.begin(), sensed_.end(), simulation::SensorBatch{});
  if (!session_.scenario.sensors.any()) return;
  const auto needs = [&](std::size_t r) {
    return written || session_.receivers[r].config().receiver().options.dead_reckoning.enabled ||
           sends_samples(r);
  };
  for (Vehicle& vehicle : vehicles_) {
    if (vehicle.fixed) continue;
    for (const Schedule& each : vehicle.receivers) {
      if (!needs(each.receiver)) continue;
      if (!vehicle.source) {
        sensors_[each.receiver].emplace(session_.trajectory->sensors());
      } else {
        constexpr double kMin_s = 0.04;
        vehicle.motion.emplace(session_.scene.city.frame,
                               std::max(kMin_s, vehicle.source->options().track.smoothing_s));
      }
    }
  }
}

void VehicleFeed::begin_at(std::int64_t run_ns) {
  session_.clock.set(run_ns);
  for (Vehicle& vehicle : vehicles_)
    for (Schedule& each : vehicle.receivers) each.epochs.begin_at(run_ns);
}

void VehicleFeed::resume(const Vehicle& vehicle) {
  const std::optional<double> stamp_s = vehicle.source->last_stamp_s();
  if (!session_.options.resume || !stamp_s || std::exchange(resumed_, true)) return;
  constexpr double kMax_s = 1e9;  // beyond, stamps are dates
  if (!(*stamp_s >= 0 && *stamp_s < kMax_s)) {
    session_.note(fmt::format(
        "live.resume has no effect: a pose's timestamp of {:.0f} s cannot be the time of a run", *stamp_s));
    return;
  }
  begin_at(std::llround(*stamp_s * 1e9));
  session_.note(fmt::format("the run's time is {:.1f} s ({}), from the first pose's timestamp", *stamp_s,
                            geodesy::format_gpst(session_.clock.start() + *stamp_s, 1)));
}

bool VehicleFeed::reset_state(Vehicle& vehicle) {
  if (session_.options.poses.size() > 1) return false;
  session_.restart();
  if (Wall::now() >= next_reset_warning_) {
    session_.warn(fmt::format("poses from {}: timestamps jumped to another clock; restarting the run at {}",
                              vehicle.source->options().from,
                              geodesy::format_gpst(session_.clock.start(), 0)));
    next_reset_warning_ = Wall::now() + std::chrono::seconds(1);
  }
  begin_at(0);
  session_.clock.forget_stamps();
  resumed_ = false;
  if (vehicle.motion) vehicle.motion.emplace(session_.scene.city.frame, vehicle.motion->step_s());
  std::fill(sensors_.begin(), sensors_.end(), std::nullopt);
  std::fill(sensed_.begin(), sensed_.end(), simulation::SensorBatch{});
  return true;
}

bool VehicleFeed::sends_samples(std::size_t receiver) const {
  return std::any_of(session_.streams.begin(), session_.streams.end(), [receiver](const auto& stream) {
    return stream->receiver() == receiver && stream->uses_sensors();
  });
}

void VehicleFeed::sample_sensors(const Vehicle& vehicle, std::size_t receiver, std::int64_t until_ns) {
  const GpsTime start = session_.clock.start();
  auto& run = sensors_[receiver];
  if (vehicle.motion) {
    const simulation::SmoothPoses& motion = *vehicle.motion;
    if (!run) {
      run.emplace(
          session_.scenario.sensors, session_.scenario.seed, start,
          [start, &motion](GpsTime t) { return motion.ecef_at(t - start); },
          [start, &motion](GpsTime t) { return motion.pose_at(t - start, t); },
          session_.scene.city.geoid_undulation_m);
    }
    run->skip(start + motion.begin_s());
  }
  if (!run) return;
  const simulation::SensorBatch& batch = run->until(start + seconds(until_ns));
  add(batch, sensed_[receiver]);
  if (session_.clock.by_stamps()) return;
  for (const auto& stream : session_.streams)
    if (stream->receiver() == receiver) stream->write_samples(batch);
}

void VehicleFeed::sample_sensors(std::int64_t now_ns) {
  if (session_.clock.by_stamps() || !session_.scenario.sensors.any()) return;
  for (Vehicle& vehicle : vehicles_) {
    for (const Schedule& each : vehicle.receivers) {
      if (each.epochs.over() || !sends_samples(each.receiver)) continue;
      std::int64_t until = std::min(now_ns, each.epochs.next_ns());
      if (vehicle.log) read_log(vehicle, vehicle.needs_ns(until));
      // The motion is known up to some steps before the last pose.
      for (int step = 0; vehicle.motion && step < 20 && !vehicle.motion->holds(until); ++step)
        until -= std::llround(vehicle.motion->step_s() * 1e9);
      if (!vehicle.source || (vehicle.motion && vehicle.motion->holds(until)))
        sample_sensors(vehicle, each.receiver, until);
    }
  }
}

bool VehicleFeed::is_due(Vehicle& vehicle, const simulation::EpochSchedule& epochs, std::int64_t now_ns) {
  const bool by_stamps = session_.clock.by_stamps();
  const std::int64_t at = epochs.next_ns();
  if (epochs.over() || (!by_stamps && now_ns < at)) return false;
  if (!vehicle.source) {
    // With stamps, fixed receivers follow the receivers with poses.
    const bool along = by_stamps && vehicle.fixed &&
                       std::any_of(vehicles_.begin(), vehicles_.end(),
                                   [](const Vehicle& other) { return other.source != nullptr; });
    return !along || at <= session_.clock.stamped_ns();
  }
  const std::int64_t needed = vehicle.needs_ns(at);
  if (vehicle.log) {
    read_log(vehicle, needed);
    return vehicle.source->track().reaches(vehicle.log->ended() ? at : needed);
  }
  if (vehicle.source->track().reaches(needed)) return true;
  return !by_stamps && seconds(now_ns - needed) >= session_.options.wait_s;
}

bool VehicleFeed::ended(const Vehicle& vehicle) const {
  const auto all = [&](auto&& holds) {
    return std::all_of(vehicle.receivers.begin(), vehicle.receivers.end(), holds);
  };
  if (all([](const Schedule& each) { return each.epochs.over(); })) return true;
  if (vehicle.log) {
    return vehicle.log->ended() && all([&](const Schedule& each) {
             return each.epochs.over() || !vehicle.source->track().reaches(each.epochs.next_ns());
           });
  }
  return vehicle.link && vehicle.link->transport().ended() && session_.clock.by_stamps();
}

bool VehicleFeed::ended() const {
  const bool moving =
      !std::all_of(vehicles_.begin(), vehicles_.end(), [](const Vehicle& vehicle) { return vehicle.fixed; });
  return std::all_of(vehicles_.begin(), vehicles_.end(),
                     [&](const Vehicle& vehicle) { return (moving && vehicle.fixed) || ended(vehicle); });
}

bool VehicleFeed::gather(std::int64_t now_ns) {
  constexpr std::size_t kBlock = 256;
  bool more = false;
  for (Vehicle& vehicle : vehicles_) {
    // In real time, one epoch per pass: links and other receivers are served before the next.
    const std::size_t maximum = session_.clock.by_stamps() ? kBlock : vehicle.receivers.size();
    for (std::size_t taken = 0; taken < maximum; ++taken) {
      const auto next = std::min_element(
          vehicle.receivers.begin(), vehicle.receivers.end(), [](const Schedule& a, const Schedule& b) {
            return !a.epochs.over() && (b.epochs.over() || a.epochs.next_ns() < b.epochs.next_ns());
          });
      if (next == vehicle.receivers.end() || !is_due(vehicle, next->epochs, now_ns)) break;
      gather(vehicle, *next, now_ns);
      more = more || taken + 1 == kBlock;
    }
  }
  return more;
}

void VehicleFeed::gather(Vehicle& vehicle, Schedule& of, std::int64_t now_ns) {
  // Epochs delayed by more than this are skipped.
  constexpr double kLatest_s = 1;
  SessionClock& clock = session_.clock;
  const geodesy::LocalFrame& frame = session_.scene.city.frame;
  Due next;
  if (!clock.by_stamps() && !vehicle.log && vehicle.source &&
      seconds(now_ns - vehicle.needs_ns(of.epochs.next_ns())) > kLatest_s)
    next.missed = static_cast<std::uint64_t>(of.epochs.catch_up(now_ns));
  if (vehicle.log)
    read_log(vehicle, vehicle.needs_ns(of.epochs.next_ns()));  // a base's log may not have been read yet
  const std::int64_t at = of.epochs.take();
  const std::size_t r = of.receiver;
  if (const std::optional<std::size_t> base = session_.receivers.base_of(r)) {
    for (Vehicle& other : vehicles_) {
      for (Schedule& each : other.receivers)
        while (each.receiver == *base && !each.epochs.over() && each.epochs.next_ns() <= at)
          gather(other, each, at);
    }
  }
  if (vehicle.source) clock.stamp(at);
  const GpsTime time = clock.start() + seconds(at);
  simulation::ReceiverGroup::Due& epoch = next.epoch;
  epoch.receiver = r;
  epoch.time = time;
  epoch.antenna = session_.receivers.fixed_pose(r, time);
  epoch.inputs.continuous = !vehicle.source;
  bool moves = !vehicle.source;
  if (vehicle.source) {
    const std::optional<simulation::RigidPose> body = vehicle.body_at(at);
    moves = body.has_value();
    const auto arrival = vehicle.source->track().last_arrival_ns();
    if (body && arrival && !clock.by_stamps()) next.pose_came = clock.wall_of(std::max(*arrival, at));
    if (body)
      epoch.antenna = simulation::pose_of(*body, {frame}, time, session_.scenario.receivers[r].lever_arm_m);
    // Between two poses and after the last one the motion is not bounded.
    if (epoch.antenna && !simulation::is_possible(*epoch.antenna, frame)) epoch.antenna.reset();
  } else if (!epoch.antenna) {
    epoch.antenna = session_.trajectory->antenna_pose(r, time);
  }
  if (moves) {
    sample_sensors(vehicle, r, at);
    next.samples = std::exchange(sensed_[r], {});
  }
  due_.push_back(std::move(next));
}

std::uint64_t VehicleFeed::check_sources() {
  std::uint64_t poses = 0;
  for (Vehicle& vehicle : vehicles_) {
    if (!vehicle.source) continue;
    PoseSource& source = *vehicle.source;
    const auto note = [&](const std::string& line) {
      session_.note(fmt::format("poses from {}: {}", source.options().from, line));
    };
    poses += source.count();
    for (const std::string& line : source.take_notes()) note(line);
    if (const auto sparse_s = vehicle.motion ? vehicle.motion->sparse_s() : std::nullopt;
        sparse_s && !std::exchange(vehicle.warned_sparse, true)) {
      note(
          fmt::format("the interval is {:.2f} s, and sensors get straight motion between two poses: set "
                      "smoothing_s to the interval, or send more",
                      *sparse_s));
    }
    const bool silent = std::exchange(vehicle.requested_at_count, source.count()) == source.count();
    vehicle.silent_s = silent ? vehicle.silent_s + 1 : 0;
    if (constexpr int kLong_s = 5; vehicle.link && vehicle.silent_s == kLong_s) {
      note(source.count() == 0 ? "none received yet: check the address and the sender"
                               : fmt::format("none received for {} s", kLong_s));
    }
    if (!silent) continue;
    if (const std::string request = source.request(); vehicle.link && !request.empty())
      vehicle.link->transport().send(request);
  }
  return poses;
}

std::optional<Wall::time_point> VehicleFeed::next_due() const {
  const SessionClock& clock = session_.clock;
  Wall::time_point until = Wall::time_point::max();
  for (const Vehicle& vehicle : vehicles_) {
    if (clock.by_stamps() && !vehicle.link && !ended(vehicle)) return std::nullopt;
    if (clock.by_stamps()) continue;
    for (const Schedule& each : vehicle.receivers) {
      if (each.epochs.over()) continue;
      const Wall::time_point at = clock.wall_of(vehicle.needs_ns(each.epochs.next_ns()));
      // After its instant, an epoch waits for a pose or for the end of wait_s.
      const auto patience =
          std::chrono::duration_cast<Wall::duration>(std::chrono::duration<double>(session_.options.wait_s));
      until = std::min(until, at > Wall::now() ? at : at + patience);
      if (sensors_[each.receiver] && sends_samples(each.receiver))
        until = std::min(until, Wall::now() + std::chrono::milliseconds(5));  // the next sample may end
    }
  }
  return until;
}

void VehicleFeed::finish() {
  std::exception_ptr failure;
  for (Vehicle& vehicle : vehicles_) {
    if (const std::uint64_t n = vehicle.source ? vehicle.source->foreign_clock_count() : 0; n > 0) {
      session_.warn(fmt::format(
          "poses from {}: {} {} dropped: their timestamps jump to another clock, and with several "
          "sources the run cannot restart; split the log, or run it alone",
          vehicle.source->options().from, n, n == 1 ? "pose was" : "poses were"));
    }
    try {
      if (vehicle.link) vehicle.link->finish(vehicle.listener, {});
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace canyon::live
