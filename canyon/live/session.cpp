#include "canyon/live/session.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/live/commands.hpp"
#include "canyon/live/pose_source.hpp"
#include "canyon/output/stream.hpp"
#include "canyon/simulation/city_scene.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::live {
namespace {

using geodesy::GpsTime;
using simulation::LiveClock;
using simulation::LiveReceiver;
using Clock = std::chrono::steady_clock;

constexpr std::string_view kTrajectory = "trajectory";
constexpr std::string_view kFile = "file:";

double seconds(std::int64_t ns) {
  return static_cast<double>(ns) * 1e-9;
}
std::int64_t nanoseconds(Clock::duration duration) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(duration).count();
}

/// A log whose poses come at their own stamps.
struct Log {
  std::string text;
  std::size_t at = 0;
  /// The next line, or so many bytes of what has no lines.
  std::string_view next(bool lines) {
    const std::string_view rest = std::string_view(text).substr(at);
    const std::size_t end = lines ? rest.find('\n') : std::string_view::npos;
    const std::string_view piece =
        rest.substr(0, end == std::string_view::npos ? (lines ? rest.size() : kBinarySize) : end + 1);
    at += piece.size();
    return piece;
  }
  [[nodiscard]] bool ended() const { return at == text.size(); }
};

/// When a receiver's epochs are due.
struct Schedule {
  std::size_t receiver = 0;
  std::int64_t offset_ns = 0;  ///< of its epochs from whole multiples of the interval
  std::int64_t next = 0;       ///< number of its next epoch
};

/// What carries antennas: a source of poses and the receivers on it.
struct Vehicle {
  std::unique_ptr<PoseSource> source;  ///< null: the trajectory, or receivers that stand still
  std::optional<Log> log;
  std::shared_ptr<transport::Link> link;
  int listener = 0;
  std::vector<Schedule> receivers;
  std::optional<double> first_stamp_s;  ///< of a log, and where stamps are the clock
  std::uint64_t asked_at_count = 0;     ///< poses when it was last asked for some
};

/// One epoch of one receiver that is due.
struct Due {
  std::size_t receiver = 0;
  double host_s = 0;
  std::optional<simulation::AntennaState> antenna;  ///< empty: no truth
  std::optional<Clock::time_point> pose_came;
  std::optional<LiveReceiver::Step> step;
};

}  // namespace

void Latencies::add(double seconds) {
  const auto tenth = static_cast<std::size_t>(std::max(0.0, seconds) * 1e4);
  ++counts_[std::min(tenth, counts_.size() - 1)];
  ++count_;
  greatest_s_ = std::max(greatest_s_, seconds);
}

double Latencies::quantile(double p) const {
  std::uint64_t seen = 0;
  const auto wanted = static_cast<std::uint64_t>(std::ceil(p * static_cast<double>(count_)));
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    seen += counts_[i];
    if (seen < wanted || seen == 0) continue;
    return i + 1 == counts_.size() ? greatest_s_ : static_cast<double>(i + 1) * 1e-4;
  }
  return 0;
}

struct Session::Impl {
  Impl(simulation::Scenario s, std::shared_ptr<simulation::CityScene> city)
      : scenario(std::move(s)),
        options(scenario.live.value_or(simulation::LiveOptions{})),
        scene(std::move(city)) {
    if (!scene) throw InputError("a live session needs a scene");
    for (auto& receiver : scenario.receivers) {
      names.push_back(receiver.options.name);
      if (receiver.fixed) receiver.fixed->settle(scene->city.frame);
    }
    if (options.poses.empty()) options.poses.emplace_back();
    set_time();
    make_receivers();
    make_vehicles();
    open_streams();
  }

  void set_time();
  void make_receivers();
  void share_propagator(LiveReceiver& receiver);
  void make_vehicles();
  void open_streams();
  [[nodiscard]] std::shared_ptr<transport::Link> link_of(const std::string& address);
  [[nodiscard]] InputError error(std::string_view problem, std::string_view cure) const {
    return {scenario.file, 0, problem, cure};
  }

  void begin_clock();
  [[nodiscard]] std::int64_t now_ns() const;
  [[nodiscard]] std::int64_t instant_ns(const Schedule& schedule) const {
    return schedule.next * interval_ns + schedule.offset_ns;
  }
  [[nodiscard]] bool is_over(const Schedule& schedule) const { return schedule.next > last; }
  [[nodiscard]] Clock::time_point wall_of(std::int64_t host_ns) const;
  [[nodiscard]] bool by_stamps() const { return options.clock == LiveClock::Stamps; }
  void read_log(Vehicle& vehicle, std::int64_t until_ns);
  [[nodiscard]] bool is_due(Vehicle& vehicle, const Schedule& schedule, std::int64_t now);
  [[nodiscard]] bool ended(const Vehicle& vehicle) const;
  /// All of those that move, or where nothing does, all.
  [[nodiscard]] bool ended() const;
  [[nodiscard]] bool stands_still(const Vehicle& vehicle) const {
    return !vehicle.receivers.empty() && scenario.receivers[vehicle.receivers.front().receiver].fixed;
  }
  /// The epochs of a vehicle that are due.
  void gather(Vehicle& vehicle, std::int64_t now);
  void gather(Vehicle& vehicle, Schedule& schedule, std::int64_t now);
  void compute_and_write();
  void serve();
  void once_a_second();
  void wait() const;
  void note(const std::string& text) const {
    if (run_options != nullptr && run_options->note) run_options->note(text);
  }

  simulation::Scenario scenario;
  simulation::LiveOptions options;
  std::shared_ptr<simulation::CityScene> scene;
  std::vector<std::string> names;
  std::unique_ptr<simulation::Simulation> trajectory;  // null: poses come from outside
  GpsTime start;
  std::int64_t interval_ns = 0;
  std::int64_t last = std::numeric_limits<std::int64_t>::max();  // number of the last epoch
  bool now_starts = false;                                       // at the next full second
  std::vector<std::shared_ptr<const propagation::Propagator>>
      propagators;  // one for each distinct set of options
  std::vector<LiveReceiver> receivers;
  std::map<std::string, std::shared_ptr<transport::Link>> links;
  std::vector<Vehicle> vehicles;
  std::vector<std::unique_ptr<output::EncodedStream>> streams;
  std::unique_ptr<Commands> commands;

  // Of a run.
  const RunOptions* run_options = nullptr;
  const std::vector<simulation::EpochSink*>* sinks = nullptr;
  Clock::time_point wall_begin;
  Clock::time_point next_second;
  std::vector<Due> due;
  Figures figures;
};

void Session::Impl::set_time() {
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
    trajectory = std::make_unique<simulation::Simulation>(scenario, scene);
    start = trajectory->begin();
    interval_ns = std::llround(trajectory->interval_s() * 1e9);
    last = static_cast<std::int64_t>(trajectory->epoch_count()) - 1;
  } else {
    if (!scenario.start)
      throw error("'start' is missing", "say when the poses begin, or leave the trajectory out");
    start = *scenario.start;
    interval_ns = std::llround(1e9 / scenario.rate_hz.value_or(10));
    if (scenario.duration_s)
      last = static_cast<std::int64_t>(std::floor(*scenario.duration_s * 1e9 + 0.5)) / interval_ns;
  }
  const bool real = std::any_of(options.poses.begin(), options.poses.end(), [](const auto& source) {
    return source.from != kTrajectory && !source.from.starts_with(kFile);
  });
  if (real && by_stamps() && options.poses.size() > 1) {
    throw error("live.clock is stamps, and there are several sources of poses",
                "have one source with all vehicles' poses in their order, or take the wall clock");
  }
  if (real && options.speed != 1) {
    throw error(fmt::format("live.speed is {}, and poses come in real time", options.speed),
                "leave it out; it is for trajectories and logs");
  }
}

void Session::Impl::make_receivers() {
  for (const auto& receiver : scenario.receivers) {
    simulation::LiveConfig config;
    config.sky = scenario.sky;
    config.start = start;
    config.rate_hz = 1e9 / static_cast<double>(interval_ns);
    config.receiver = receiver;
    config.seed = scenario.seed;
    config.faults = scenario.faults;
    receivers.emplace_back(std::move(config), scene, start);
    share_propagator(receivers.back());
  }
}

// What is found in the city's surfaces is large: receivers that look in the same way have it once, and in the
// processor's cache.
void Session::Impl::share_propagator(LiveReceiver& receiver) {
  const propagation::PropagationOptions& wanted = receiver.config().receiver.propagation;
  auto found = std::find_if(propagators.begin(), propagators.end(),
                            [&](const auto& each) { return each->options() == wanted; });
  if (found == propagators.end()) {
    propagators.push_back(
        std::make_shared<const propagation::Propagator>(scene->city.mesh, scene->scene, wanted));
    found = propagators.end() - 1;
  }
  receiver.set_tracer([propagator = *found](const Eigen::Vector3d& antenna,
                                            std::span<const Eigen::Vector3d> directions,
                                            std::span<propagation::SatellitePaths> result) {
    propagator->trace(antenna, directions, result);
  });
}

std::shared_ptr<transport::Link> Session::Impl::link_of(const std::string& address) {
  std::shared_ptr<transport::Link>& link = links[address];
  if (!link) link = std::make_shared<transport::Link>(address);
  return link;
}

void Session::Impl::make_vehicles() {
  std::vector<const std::string*> driver(names.size(), nullptr);
  const auto take = [&](Vehicle& vehicle, std::size_t r, const std::string& from) {
    if (scenario.receivers[r].fixed) {
      throw error(fmt::format("live.poses: '{}' moves receiver '{}', which is fixed", from, names[r]),
                  "leave one of them out");
    }
    if (driver[r] != nullptr) {
      throw error(
          fmt::format("live.poses: '{}' and '{}' both move receiver '{}'", *driver[r], from, names[r]),
          "name each receiver in one source");
    }
    driver[r] = &from;
    const auto n = static_cast<std::int64_t>(names.size());
    const std::int64_t offset_ns = options.stagger ? interval_ns * static_cast<std::int64_t>(r) / n : 0;
    vehicle.receivers.push_back({r, offset_ns, 0});
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
      for (std::size_t r = 0; r < names.size(); ++r) {
        if (driver[r] == nullptr && !scenario.receivers[r].fixed) take(vehicle, r, source.from);
      }
    }
    if (source.from == kTrajectory) continue;
    vehicle.source = std::make_unique<PoseSource>(source, scene->city.frame);
    if (source.from.starts_with(kFile)) {
      vehicle.log.emplace();
      vehicle.log->text = TextFile(source.from.substr(kFile.size())).text();
      continue;
    }
    vehicle.link = link_of(source.from);
    vehicle.listener = vehicle.link->listen([this, i](const transport::Heard& heard) {
      Vehicle& self = vehicles[i];
      if (!by_stamps()) {
        self.source->hear(heard.reader, heard.bytes, now_ns());
        return;
      }
      self.source->hear_log(heard.bytes, self.first_stamp_s, [&](std::int64_t now) {
        gather(self, now);
        compute_and_write();
      });
    });
  }
  for (std::size_t r = 0; r < names.size(); ++r) {
    if (driver[r] != nullptr) continue;
    if (scenario.receivers[r].fixed) {
      vehicles.emplace_back().receivers.push_back({r, 0, 0});
      continue;
    }
    throw error(fmt::format("live.poses: nothing moves receiver '{}'", names[r]),
                "name it in a source, or add a source without 'receivers'");
  }
}

void Session::Impl::open_streams() {
  for (std::size_t i = 0; i < options.streams.size(); ++i) {
    const simulation::StreamRequest& request = options.streams[i];
    try {
      const std::size_t r = output::find_receiver(request, names);
      const simulation::BuiltSky& sky = receivers[r].sky();
      output::ReceiverDescription description = output::describe_receiver(
          scenario.receivers[r].options, *sky.sky, sky.navigation, start, seconds(interval_ns));
      if (const auto& fixed = scenario.receivers[r].fixed) {
        description.station_ecef = geodesy::ecef_from_geodetic(fixed->place);
      }
      streams.push_back(output::open_stream(request, r, description, link_of(request.address)));
    } catch (const InputError& e) {
      if (!e.file().empty()) throw;
      throw error(fmt::format("live.streams[{}]: {}", i, e.problem()), e.cure());
    }
  }
  if (options.control.empty()) return;
  CommandContext context{scenario,
                         receivers,
                         figures,
                         options.changes,
                         [this] { return seconds(now_ns()); },
                         [this](LiveReceiver& receiver) { share_propagator(receiver); }};
  commands = std::make_unique<Commands>(std::move(context), link_of(options.control));
}

void Session::Impl::begin_clock() {
  wall_begin = Clock::now();
  if (now_starts) {
    const auto utc = std::chrono::system_clock::now().time_since_epoch();
    const double ahead_s =
        start - geodesy::gps_from_unix(std::chrono::duration_cast<std::chrono::nanoseconds>(utc).count());
    // The scenario's second may have passed while the city was read.
    wall_begin += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(ahead_s));
    const auto late = static_cast<std::int64_t>(std::ceil(-ahead_s * 1e9 / static_cast<double>(interval_ns)));
    for (Vehicle& vehicle : vehicles) {
      for (Schedule& schedule : vehicle.receivers) schedule.next = std::max<std::int64_t>(0, late);
    }
  }
  next_second = Clock::now() + std::chrono::seconds(1);
}

std::int64_t Session::Impl::now_ns() const {
  const std::int64_t wall_ns = nanoseconds(Clock::now() - wall_begin);
  return options.speed == 1 ? wall_ns
                            : static_cast<std::int64_t>(static_cast<double>(wall_ns) * options.speed);
}

Clock::time_point Session::Impl::wall_of(std::int64_t host_ns) const {
  return wall_begin +
         std::chrono::nanoseconds(static_cast<std::int64_t>(static_cast<double>(host_ns) / options.speed));
}

void Session::Impl::read_log(Vehicle& vehicle, std::int64_t until_ns) {
  Log& log = *vehicle.log;
  const bool lines = vehicle.source->options().format == simulation::PoseFormat::Json;
  while (!log.ended() && !vehicle.source->track().reaches(until_ns)) {
    vehicle.source->hear_log(log.next(lines), vehicle.first_stamp_s, [](std::int64_t) {});
  }
}

bool Session::Impl::ended(const Vehicle& vehicle) const {
  const auto all = [&](auto&& holds) {
    return std::all_of(vehicle.receivers.begin(), vehicle.receivers.end(), holds);
  };
  if (all([&](const Schedule& schedule) { return is_over(schedule); })) return true;
  if (vehicle.log) {
    return vehicle.log->ended() && all([&](const Schedule& schedule) {
             return is_over(schedule) || !vehicle.source->track().reaches(instant_ns(schedule));
           });
  }
  return vehicle.link && vehicle.link->transport().ended() && by_stamps();
}

bool Session::Impl::ended() const {
  const bool moving = !std::all_of(vehicles.begin(), vehicles.end(),
                                   [this](const Vehicle& vehicle) { return stands_still(vehicle); });
  return std::all_of(vehicles.begin(), vehicles.end(), [&](const Vehicle& vehicle) {
    return (moving && stands_still(vehicle)) || ended(vehicle);
  });
}

bool Session::Impl::is_due(Vehicle& vehicle, const Schedule& schedule, std::int64_t now) {
  const std::int64_t at = instant_ns(schedule);
  if (is_over(schedule) || (!by_stamps() && now < at)) return false;
  if (!vehicle.source) return true;
  if (vehicle.log) {
    read_log(vehicle, at);
    return vehicle.source->track().reaches(at);
  }
  if (vehicle.source->track().reaches(at)) return true;
  return !by_stamps() && seconds(now - at) >= options.wait_s;
}

void Session::Impl::gather(Vehicle& vehicle, std::int64_t now) {
  for (Schedule& schedule : vehicle.receivers) {
    // In real time one at a time: links are served, and others' epochs sent, before the next one.
    while (is_due(vehicle, schedule, now)) {
      gather(vehicle, schedule, now);
      if (!by_stamps()) break;
    }
  }
}

void Session::Impl::gather(Vehicle& vehicle, Schedule& schedule, std::int64_t now) {
  // What is later than this is left out: nobody wants the past.
  constexpr double kLatest_s = 1;
  if (!by_stamps() && !vehicle.log && vehicle.source && seconds(now - instant_ns(schedule)) > kLatest_s) {
    const std::int64_t latest = std::min(last, (now - schedule.offset_ns) / interval_ns);
    figures.missed += static_cast<std::uint64_t>(latest - schedule.next);
    schedule.next = latest;
  }
  const std::int64_t at = instant_ns(schedule);
  ++schedule.next;
  const std::size_t r = schedule.receiver;
  std::string reason;
  std::optional<simulation::TruePose> body;
  std::optional<Clock::time_point> came;
  if (vehicle.source) {
    body = vehicle.source->track().at(at, reason);
    if (const auto arrival = vehicle.source->track().last_arrival_ns(); body && arrival && !by_stamps()) {
      came = wall_of(std::max(*arrival, at));
    }
  }
  Due epoch{r, seconds(at), {}, came, {}};
  if (const auto& fixed = scenario.receivers[r].fixed) {
    epoch.antenna = simulation::antenna_state({start + seconds(at), fixed->place}, scene->city.frame);
  } else if (!vehicle.source) {
    epoch.antenna =
        simulation::antenna_state(trajectory->antenna_pose(r, start + seconds(at)), scene->city.frame);
  } else if (body) {
    epoch.antenna =
        simulation::antenna_of(*body, scenario.receivers[r].lever_arm_m, 0, Eigen::Vector3d::Zero());
  }
  due.push_back(std::move(epoch));
}

void Session::Impl::compute_and_write() {
  if (due.empty()) return;
  const auto observe = [this](std::size_t i) {
    Due& epoch = due[i];
    LiveReceiver& receiver = receivers[epoch.receiver];
    epoch.step = epoch.antenna ? receiver.observe(epoch.host_s, *epoch.antenna) : receiver.lose(epoch.host_s);
  };
  // A receiver may be due twice, where the run is late: its epochs stay in order.
  for (std::size_t begin = 0; begin < due.size();) {
    std::size_t end = begin;
    std::vector<bool> seen(receivers.size());
    while (end < due.size() && !seen[due[end].receiver]) seen[due[end++].receiver] = true;
    if (end - begin == 1) {
      observe(begin);
    } else {
      tbb::parallel_for(begin, end, observe);
    }
    begin = end;
  }
  for (Due& epoch : due) {
    simulation::Epoch& out = epoch.step->epoch;
    out.receiver = epoch.receiver;
    out.arrival = &epoch.step->arrival;
    ++figures.epochs;
    if (out.observed.fix.solved()) ++figures.fixes;
    if (!epoch.antenna) ++figures.no_truth;
    for (const auto& stream : streams) stream->write(out);
    for (simulation::EpochSink* sink : *sinks) sink->write(out);
    if (commands) commands->keep(out);
    if (epoch.pose_came) {
      figures.latency.add(std::chrono::duration<double>(Clock::now() - *epoch.pose_came).count());
    }
    for (const std::string& line : receivers[epoch.receiver].take_warnings()) {
      note(fmt::format("{}: {}", names[epoch.receiver], line));
    }
  }
  due.clear();
}

void Session::Impl::serve() {
  for (const auto& [address, link] : links) link->serve();
  for (const auto& stream : streams) stream->send_due();
}

void Session::Impl::once_a_second() {
  if (Clock::now() < next_second) return;
  next_second += std::chrono::seconds(1);
  figures.poses = 0;
  for (Vehicle& vehicle : vehicles) {
    if (!vehicle.source) continue;
    figures.poses += vehicle.source->count();
    for (const std::string& line : vehicle.source->take_notes()) {
      note(fmt::format("poses from {}: {}", vehicle.source->options().from, line));
    }
    if (std::exchange(vehicle.asked_at_count, vehicle.source->count()) != vehicle.source->count()) continue;
    if (const std::string request = vehicle.source->request(); vehicle.link && !request.empty()) {
      vehicle.link->transport().send(request);
    }
  }
  for (const auto& [address, link] : links) {
    for (const std::string& line : link->take_notes()) note(fmt::format("{}: {}", address, line));
  }
  figures.host_s = by_stamps() ? figures.host_s : seconds(now_ns());
  if (run_options->progress) run_options->progress(figures);
}

void Session::Impl::wait() const {
  // Nothing waits longer than this: servers take clients, drivers get their answers.
  Clock::time_point until = Clock::now() + std::chrono::milliseconds(20);
  for (const Vehicle& vehicle : vehicles) {
    if (by_stamps() && !vehicle.link && !ended(vehicle)) return;
    if (by_stamps()) continue;
    for (const Schedule& schedule : vehicle.receivers) {
      if (is_over(schedule)) continue;
      const Clock::time_point at = wall_of(instant_ns(schedule));
      // Behind its instant an epoch waits for a pose, which wakes, or for its time to run out.
      const auto patience =
          std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options.wait_s));
      until = std::min(until, at > Clock::now() ? at : at + patience);
    }
  }
  for (const auto& stream : streams) {
    if (const auto next = stream->next_due()) until = std::min(until, *next);
  }
  std::vector<int> handles;
  for (const auto& [address, link] : links) link->transport().add_handles(handles);
  std::vector<pollfd> polled;
  for (const int handle : handles) polled.push_back({handle, POLLIN, 0});
  const auto left = std::max<std::int64_t>(0, nanoseconds(until - Clock::now()));
  const timespec timeout{static_cast<time_t>(left / 1'000'000'000), static_cast<long>(left % 1'000'000'000)};
  ppoll(polled.data(), polled.size(), &timeout, nullptr);
}

Session::Session(simulation::Scenario scenario, std::shared_ptr<simulation::CityScene> scene)
    : impl_(std::make_unique<Impl>(std::move(scenario), std::move(scene))) {}
Session::~Session() = default;

geodesy::GpsTime Session::start() const {
  return impl_->start;
}
double Session::interval_s() const {
  return seconds(impl_->interval_ns);
}
const simulation::Scenario& Session::scenario() const {
  return impl_->scenario;
}

Figures Session::run(const std::vector<simulation::EpochSink*>& sinks, const RunOptions& options) {
  Impl& impl = *impl_;
  impl.run_options = &options;
  impl.sinks = &sinks;
  impl.figures = {};
  impl.begin_clock();
  for (std::size_t r = 0; r < impl.receivers.size(); ++r) {
    for (const std::string& line : impl.receivers[r].take_warnings()) impl.note(impl.names[r] + ": " + line);
  }
  for (const auto& [address, link] : impl.links) {
    for (const std::string& line : link->take_notes()) impl.note(fmt::format("{}: {}", address, line));
  }
  const auto running = [&] {
    return (options.stop == nullptr || !*options.stop) && !(impl.commands && impl.commands->stopped());
  };
  while (running()) {
    impl.serve();
    const std::int64_t now = impl.now_ns();
    for (Vehicle& vehicle : impl.vehicles) {
      // By stamps, those that are heard of are due when a pose is.
      if (impl.by_stamps() && vehicle.link) continue;
      impl.gather(vehicle, now);
    }
    impl.compute_and_write();
    impl.once_a_second();
    if (impl.ended()) break;
    impl.wait();
  }
  std::exception_ptr failure;
  const auto finish = [&](simulation::EpochSink& sink) {
    try {
      sink.finish();
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  };
  for (const auto& stream : impl.streams) finish(*stream);
  for (simulation::EpochSink* sink : sinks) finish(*sink);
  impl.next_second = {};
  impl.once_a_second();
  if (failure) std::rethrow_exception(failure);
  return impl.figures;
}

}  // namespace canyon::live
