#include "canyon/live/session.hpp"

#include <poll.h>

#include "canyon/geodesy/time_scales.hpp"
#include "canyon/live/session_impl.hpp"
#include "canyon/output/epoch_values.hpp"
#include "canyon/output/nmea.hpp"

namespace canyon::live {
namespace {

// Latencies: the first step, and the ratio of each to the one before.
constexpr double kFirstStep_s = 1e-5, kStepRatio = 1.01;

std::int64_t nanoseconds(Clock::duration duration) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(duration).count();
}

}  // namespace

void Latencies::add(double seconds) {
  const double step = std::log(std::max(seconds, kFirstStep_s) / kFirstStep_s) / std::log(kStepRatio);
  ++counts_[std::min(static_cast<std::size_t>(step), counts_.size() - 1)];
  ++count_;
  greatest_s_ = std::max(greatest_s_, seconds);
}

double Latencies::quantile(double p) const {
  std::uint64_t seen = 0;
  const auto wanted = static_cast<std::uint64_t>(std::ceil(p * static_cast<double>(count_)));
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    seen += counts_[i];
    if (seen < wanted || seen == 0) continue;
    return std::min(kFirstStep_s * std::pow(kStepRatio, static_cast<double>(i + 1)), greatest_s_);
  }
  return 0;
}

void Session::Impl::begin_clock() {
  wall_begin = Clock::now();
  if (now_starts) {
    const auto utc = std::chrono::system_clock::now().time_since_epoch();
    const double ahead_s =
        start - geodesy::gps_from_unix(std::chrono::duration_cast<std::chrono::nanoseconds>(utc).count());
    // The scenario's second may have passed while the city was read.
    wall_begin += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(ahead_s));
    const auto late = static_cast<std::int64_t>(std::ceil(-ahead_s / schedule.interval_s()));
    for (Vehicle& vehicle : vehicles) {
      for (Schedule& each : vehicle.receivers) each.epochs.go_to(late);
    }
  }
  next_second = Clock::now() + std::chrono::seconds(1);
}

void Session::Impl::begin_at(std::int64_t run_ns) {
  if (!by_stamps()) wall_begin += Clock::now() - wall_of(run_ns);
  for (Vehicle& vehicle : vehicles) {
    for (Schedule& each : vehicle.receivers) each.epochs.begin_at(run_ns);
  }
}

void Session::Impl::resume(const Vehicle& vehicle) {
  const std::optional<double> stamp_s = vehicle.source->last_stamp_s();
  if (!options.resume || !stamp_s || std::exchange(resumed, true)) return;
  constexpr double kLongest_s = 1e9;  // beyond, stamps are dates
  if (!(*stamp_s >= 0 && *stamp_s < kLongest_s)) {
    note(fmt::format("live.resume has no effect: a pose's stamp of {:.0f} s is not a time of a run",
                     *stamp_s));
    return;
  }
  begin_at(std::llround(*stamp_s * 1e9));
  note(fmt::format("the time is {:.1f} s ({}), by the first pose's stamp", *stamp_s,
                   geodesy::format_gpst(start + *stamp_s, 1)));
}

bool Session::Impl::begin_anew(Vehicle& vehicle) {
  if (options.poses.size() > 1) return false;
  compute_and_write();
  if (Clock::now() >= next_anew) {
    warn(fmt::format("poses from {}: the stamps are of another clock than before: the run begins anew at {}",
                     vehicle.source->options().from, geodesy::format_gpst(start, 0)));
    next_anew = Clock::now() + std::chrono::seconds(1);
  }
  begin_at(0);
  resumed = false;
  stamped_ns = -1;
  if (vehicle.motion) vehicle.motion.emplace(scene->city.frame, vehicle.motion->step_s());
  corrections.emplace(scenario.receivers, scenario.seed);
  for (std::size_t r = 0; r < receivers.size(); ++r) {
    receivers[r].restart();
    sensors[r].reset();
    if (!inputs[r]) continue;
    inputs[r]->reported.reset();
    inputs[r]->input.begin_anew();
  }
  return true;
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
  bool anew = false;  // what comes behind it is of a later time than until_ns
  while (!anew && !log.ended() && !vehicle.source->track().reaches(until_ns)) {
    vehicle.source->receive_log(
        {0, std::string(log.next(lines)), lines}, false,
        [&](std::int64_t now_ns) { vehicle.pose_came(now_ns); }, [&] { return anew = begin_anew(vehicle); });
  }
}

bool Session::Impl::ended(const Vehicle& vehicle) const {
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

bool Session::Impl::ended() const {
  const bool moving = !std::all_of(vehicles.begin(), vehicles.end(),
                                   [this](const Vehicle& vehicle) { return stands_still(vehicle); });
  return std::all_of(vehicles.begin(), vehicles.end(), [&](const Vehicle& vehicle) {
    return (moving && stands_still(vehicle)) || ended(vehicle);
  });
}

bool Session::Impl::is_due(Vehicle& vehicle, const simulation::EpochSchedule& epochs, std::int64_t now) {
  const std::int64_t at = epochs.next_ns();
  if (epochs.over() || (!by_stamps() && now < at)) return false;
  if (!vehicle.source) {
    // By stamps, receivers that stand still follow the receivers with poses.
    const bool along = by_stamps() && stands_still(vehicle) &&
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

bool Session::Impl::gather(std::int64_t now) {
  constexpr std::size_t kBlock = 256;
  bool more = false;
  for (Vehicle& vehicle : vehicles) {
    // In real time it takes one epoch a turn: links are served, and others' epochs sent, before the next one.
    const std::size_t most = by_stamps() ? kBlock : vehicle.receivers.size();
    for (std::size_t taken = 0; taken < most; ++taken) {
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

void Session::Impl::gather(Vehicle& vehicle, Schedule& of, std::int64_t now) {
  // Epochs that are later than this are left out.
  constexpr double kLatest_s = 1;
  if (!by_stamps() && !vehicle.log && vehicle.source &&
      seconds(now - vehicle.needs_ns(of.epochs.next_ns())) > kLatest_s) {
    figures.missed += static_cast<std::uint64_t>(of.epochs.catch_up(now));
  }
  if (vehicle.log) read_log(vehicle, vehicle.needs_ns(of.epochs.next_ns()));  // of a base, which nobody asked
  const std::int64_t at = of.epochs.take();
  const std::size_t r = of.receiver;
  gather_base_of(r, at);
  if (vehicle.source) stamped_ns = std::max(stamped_ns, at);
  std::optional<simulation::TruePose> body;
  std::optional<Clock::time_point> came;
  if (vehicle.source) {
    body = vehicle.body_at(at);
    if (const auto arrival = vehicle.source->track().last_arrival_ns(); body && arrival && !by_stamps()) {
      came = wall_of(std::max(*arrival, at));
    }
  }
  Due epoch{r, seconds(at), {}, came};
  if (body || !vehicle.source) take_samples(vehicle, epoch);
  if (const auto& fixed = scenario.receivers[r].fixed) {
    epoch.antenna = simulation::antenna_state({start + seconds(at), fixed->place}, scene->city.frame);
  } else if (!vehicle.source) {
    epoch.antenna =
        simulation::antenna_state(trajectory->antenna_pose(r, start + seconds(at)), scene->city.frame);
  } else if (body) {
    epoch.antenna =
        simulation::antenna_of(*body, scenario.receivers[r].lever_arm_m, 0, Eigen::Vector3d::Zero());
    // Between two poses, and behind the last one, the motion may lead anywhere.
    if (!simulation::is_possible(*epoch.antenna)) epoch.antenna.reset();
  }
  due.push_back(std::move(epoch));
}

void Session::Impl::gather_base_of(std::size_t receiver, std::int64_t until_ns) {
  const std::optional<std::size_t> base = corrections->base_of(receiver);
  if (!base) return;
  for (Vehicle& vehicle : vehicles) {
    for (Schedule& each : vehicle.receivers) {
      if (each.receiver != *base) continue;
      while (!each.epochs.over() && each.epochs.next_ns() <= until_ns) gather(vehicle, each, until_ns);
    }
  }
}

std::optional<simulation::TruePose> Vehicle::body_at(std::int64_t at) {
  std::string reason;
  if (!motion) return source->track().at(at, reason);
  motion->reach(source->track(), at);
  if (!motion->holds(at)) return std::nullopt;
  return motion->at(seconds(at));
}

void Session::Impl::begin_sensors() {
  sensors.clear();
  sensors.resize(receivers.size());
  if (!scenario.sensors.any()) return;
  const bool written = std::any_of(sinks->begin(), sinks->end(),
                                   [](const simulation::EpochSink* sink) { return sink->uses_sensors(); });
  const auto needs = [&](std::size_t r) {
    return written || receivers[r].config().receiver().options.dead_reckoning.enabled ||
           std::any_of(streams.begin(), streams.end(),
                       [r](const auto& stream) { return stream->receiver() == r && stream->uses_sensors(); });
  };
  for (Vehicle& vehicle : vehicles) {
    if (stands_still(vehicle)) continue;
    for (const Schedule& each : vehicle.receivers) {
      if (!needs(each.receiver)) continue;
      if (!vehicle.source) {
        sensors[each.receiver].emplace(trajectory->sensors());
      } else {
        constexpr double kLeast_s = 0.04;
        vehicle.motion.emplace(scene->city.frame,
                               std::max(kLeast_s, vehicle.source->options().track.smoothing_s));
      }
    }
  }
}

void Session::Impl::take_samples(const Vehicle& vehicle, Due& epoch) {
  auto& run = sensors[epoch.receiver];
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
  if (run) epoch.samples = run->until(start + epoch.host_s);
}

void Session::Impl::compute_and_write() {
  // A stream's link may bring poses while it is written.
  std::vector<Due> block = std::exchange(due, {});
  if (block.empty()) return;
  // A receiver may be due twice, where the run is late.
  std::vector<simulation::DueEpoch> instants;
  instants.reserve(block.size());
  for (const Due& epoch : block) instants.push_back({epoch.receiver, start + epoch.host_s});
  corrections->make_epochs(instants, true, [&](std::size_t i, auto came) -> simulation::Epoch& {
    Due& epoch = block[i];
    LiveReceiver& receiver = receivers[epoch.receiver];
    if (inputs[epoch.receiver]) came = inputs[epoch.receiver]->input.take(instants[i].time);
    if (came) receiver.give(std::move(came));
    if (!epoch.antenna) {
      epoch.step = receiver.lose(epoch.host_s);
      return epoch.step.epoch;
    }
    epoch.step =
        receiver.observe(epoch.host_s, *epoch.antenna, sensors[epoch.receiver] ? &epoch.samples : nullptr);
    return epoch.step.epoch;
  });
  for (Due& epoch : block) {
    simulation::Epoch& out = epoch.step.epoch;
    out.arrival = &epoch.step.arrival;
    ++figures.epochs;
    figures.host_s = epoch.host_s;
    if (out.observed.fix.solved()) ++figures.fixes;
    if (!out.observed.fix.solved()) {
      figures.no_fix = fmt::format("{}: {}", names[epoch.receiver],
                                   output::no_fix_reason(out.observed.fix, out.placement));
    } else if (figures.no_fix.starts_with(names[epoch.receiver] + ": ")) {
      figures.no_fix.clear();
    }
    if (!epoch.antenna) ++figures.no_truth;
    for (const auto& stream : streams) stream->write(out);
    report_place(out);
    for (simulation::EpochSink* sink : *sinks) sink->write(out);
    if (commands) commands->keep(out);
    if (epoch.pose_came) {
      figures.latency.add(std::chrono::duration<double>(Clock::now() - *epoch.pose_came).count());
    }
    say_warnings(epoch.receiver);
  }
}

void Session::Impl::report_place(const simulation::Epoch& epoch) {
  constexpr double kReportEvery_s = 10;
  const auto& input = inputs[epoch.receiver];
  if (!input) return;
  input->input.set_place(epoch.truth_ecef);
  if (!input->caster || !epoch.observed.fix.solved()) return;
  if (input->reported && epoch.observed.time - *input->reported < kReportEvery_s) return;
  input->reported = epoch.observed.time;
  input->caster->transport().send(output::nmea_gga(epoch));
}

void Session::Impl::serve() {
  for (const auto& [address, link] : links) link->serve();
  for (const auto& stream : streams) {
    stream->send_due();
    const std::string line = output::hand_on(*stream, receivers[stream->receiver()]);
    if (!line.empty()) note(fmt::format("{}: {}", names[stream->receiver()], line));
  }
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
    if (const auto sparse_s = vehicle.motion ? vehicle.motion->sparse_s() : std::nullopt;
        sparse_s && !std::exchange(vehicle.said_sparse, true)) {
      note(fmt::format(
          "poses from {}: they come {:.2f} s apart, and between two of them sensors feel a straight "
          "way: set smoothing_s to that, or send more",
          vehicle.source->options().from, *sparse_s));
    }
    const bool silent =
        std::exchange(vehicle.asked_at_count, vehicle.source->count()) == vehicle.source->count();
    vehicle.silent_s = silent ? vehicle.silent_s + 1 : 0;
    if (constexpr int kLong_s = 5; vehicle.link && vehicle.silent_s == kLong_s) {
      note(fmt::format("poses from {}: none has come {}", vehicle.source->options().from,
                       vehicle.source->count() == 0 ? "yet: check the address, and who sends there"
                                                    : fmt::format("for {} s", kLong_s)));
    }
    if (!silent) continue;
    if (const std::string request = vehicle.source->request(); vehicle.link && !request.empty()) {
      vehicle.link->transport().send(request);
    }
  }
  for (const auto& [address, link] : links) {
    for (const std::string& line : link->take_notes()) note(fmt::format("{}: {}", address, line));
  }
  if (run_options->progress) run_options->progress(figures);
}

bool Session::Impl::turn() {
  serve();
  gather(now_ns());
  compute_and_write();
  once_a_second();
  return !ended();
}

void Session::Impl::wait() const {
  // Nothing waits longer than this: servers take clients, drivers get their answers.
  Clock::time_point until = Clock::now() + std::chrono::milliseconds(20);
  for (const Vehicle& vehicle : vehicles) {
    if (by_stamps() && !vehicle.link && !ended(vehicle)) return;
    if (by_stamps()) continue;
    for (const Schedule& each : vehicle.receivers) {
      if (each.epochs.over()) continue;
      const Clock::time_point at = wall_of(vehicle.needs_ns(each.epochs.next_ns()));
      // An epoch waits after its instant for a pose or for the end of wait_s.
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
  polled.reserve(handles.size());
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
  return impl_->schedule.interval_s();
}
const simulation::Scenario& Session::scenario() const {
  return impl_->scenario;
}

Figures Session::run(const std::vector<simulation::EpochSink*>& sinks, const RunOptions& options) {
  Impl& impl = *impl_;
  impl.run_options = &options;
  impl.sinks = &sinks;
  impl.figures = {};
  impl.begin_sensors();
  impl.begin_clock();
  for (std::size_t r = 0; r < impl.receivers.size(); ++r) impl.say_warnings(r);
  for (const auto& [address, link] : impl.links) {
    for (const std::string& line : link->take_notes()) impl.note(fmt::format("{}: {}", address, line));
  }
  std::exception_ptr failure;
  const auto finish = [&](const auto& end) {
    try {
      end();
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  };
  // Epochs until then are kept, whatever ends the run.
  finish([&] {
    while (impl.running() && impl.turn()) impl.wait();
  });
  for (const auto& stream : impl.streams) finish([&] { stream->finish(); });
  for (simulation::EpochSink* sink : sinks) finish([&] { sink->finish(); });
  impl.next_second = {};
  finish([&] { impl.once_a_second(); });
  // A link that poses and streams share ends here.
  for (Vehicle& vehicle : impl.vehicles) {
    if (const std::uint64_t n = vehicle.source ? vehicle.source->of_another_clock() : 0; n > 0) {
      impl.warn(
          fmt::format("poses from {}: {} {} dropped, since their stamps jump to another clock, and with "
                      "several sources the run cannot begin anew: divide the log, or run it alone",
                      vehicle.source->options().from, n, n == 1 ? "pose was" : "poses were"));
    }
    if (vehicle.link) finish([&] { vehicle.link->finish(vehicle.listener, {}); });
  }
  if (failure) std::rethrow_exception(failure);
  return impl.figures;
}

}  // namespace canyon::live
