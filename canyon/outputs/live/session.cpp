#include "canyon/outputs/live/session.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <span>
#include <thread>
#include <utility>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/outputs/encoding/epoch_values.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/outputs/live/controls.hpp"
#include "canyon/outputs/live/correction_feed.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"
#include "canyon/outputs/live/pose_source.hpp"
#include "canyon/outputs/live/session_clock.hpp"
#include "canyon/outputs/live/vehicle_feed.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/receiver_group.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/sensor_run.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::live {

namespace {
using simulation::ReceiverRunner;
using Clock = SessionClock::Wall;
}  // namespace

struct Session::Impl {
  Impl(simulation::Scenario s, std::shared_ptr<simulation::CityScene> city)
      : scenario(std::move(s)),
        options(scenario.live.value_or(simulation::LiveOptions{})),
        scene(std::move(city)),
        names(simulation::receiver_names(scenario.receivers)),
        clock(make_clock()),
        receivers(make_receivers()),
        corrections(scenario, links, clock),
        vehicles({scenario, options, *scene, trajectory.get(), clock, receivers, links, streams,
                  [this](std::int64_t now_ns) {
                    for (bool more = true; more && running();) {
                      more = vehicles.gather(now_ns);
                      compute_and_write();
                    }
                  },
                  [this] { reset_state(); }, [this](const std::string& line) { note(line); },
                  [this](const std::string& line) { warn(line); }}) {
    open_streams();
  }

  /// Checks the options, resolves fixed positions, and makes the trajectory.
  SessionClock make_clock() {
    if (!scene) throw InputError("a live session needs a scene");
    options::check(options, "live.");
    for (auto& receiver : scenario.receivers)
      if (receiver.fixed) receiver.fixed->resolve(scene->city.frame);
    if (options.poses.empty()) options.poses.emplace_back();
    const bool has_start = scenario.start || scenario.trajectory.file;
    if (!has_start) {
      const auto utc = std::chrono::system_clock::now().time_since_epoch();
      const auto second = std::chrono::ceil<std::chrono::seconds>(utc);
      scenario.start = geodesy::gps_from_unix(std::chrono::nanoseconds(second).count());
    }
    if (std::any_of(options.poses.begin(), options.poses.end(),
                    [](const auto& source) { return source.is_trajectory(); })) {
      simulation::Scenario trajectory_scenario = scenario;
      for (simulation::ReceiverConfig& receiver : trajectory_scenario.receivers)
        if (rtk::is_stream(receiver.options.corrections.from)) receiver.options.corrections.from.clear();
      trajectory = std::make_unique<simulation::Simulation>(std::move(trajectory_scenario), scene);
    }
    return SessionClock(scenario, options, trajectory.get(), !has_start);
  }

  simulation::ReceiverGroup make_receivers() {
    simulation::RunnerConfig config =
        simulation::live_config(scenario, clock.start(), clock.schedule().interval_s());
    config.with_sensors = scenario.sensors.any();
    simulation::ReceiverGroup group(std::move(config), scene, clock.start());
    // Prepared now, so that the first epoch is not late.
    for (std::size_t r = 0; r < group.size(); ++r) {
      const ReceiverRunner& receiver = group[r];
      prepared.push_back(receiver.environment().make_propagator(receiver.config().receiver().propagation));
    }
    return group;
  }

  void open_streams() {
    for (std::size_t i = 0; i < options.streams.size(); ++i) {
      const simulation::StreamRequest& request = options.streams[i];
      try {
        const std::size_t r = encoding::find_receiver(request, names);
        const simulation::BuiltSky& sky = receivers[r].sky();
        encoding::ReceiverDescription description = encoding::describe_receiver(
            scenario.receivers[r], *sky.sky, sky.navigation, clock.start(), clock.schedule().interval_s());
        description.sensors = simulation::sensors_of(scenario, r);
        streams.push_back(
            encoding::open_stream(request, r, description, transport::link_of(links, request.address)));
      } catch (const InputError& e) {
        if (!e.file().empty()) throw;
        throw InputError(fmt::format("stream {}: {}", i + 1, e.problem()), e.hint());
      }
    }
    if (options.control.empty()) return;
    CommandContext context{std::filesystem::absolute(scenario.file), {}, metrics, options.changes, [this] {
                             return seconds(clock.now_ns());
                           }};
    for (std::size_t r = 0; r < names.size(); ++r)
      context.receivers.push_back({names[r], &receivers[r], {}, nullptr, false});
    commands = make_commands(std::move(context), transport::link_of(links, options.control));
  }

  /// All but the vehicles, after the computation of the epochs until then.
  void reset_state() {
    compute_and_write();
    receivers.restart();
    corrections.reset_state();
  }

  [[nodiscard]] bool running() const {
    return (run_options->stop == nullptr || !*run_options->stop) && !(commands && commands->stopped());
  }

  void compute_and_write() {
    // Writing to a stream may receive poses by its link.
    std::vector<VehicleFeed::Due> block = vehicles.take_due();
    if (block.empty()) return;
    for (VehicleFeed::Due& each : block) {
      each.epoch.corrections = corrections.take(each.epoch.receiver, each.epoch.time);
      metrics.missed += each.missed;
    }
    // A receiver may have several due epochs; epochs of different receivers are computed in parallel.
    std::stable_sort(block.begin(), block.end(),
                     [](const auto& a, const auto& b) { return a.epoch.time < b.epoch.time; });
    // Limits the epochs computed before the first is written: an epoch takes some 150 kB.
    constexpr std::size_t kTogether = 32;
    for (std::span<VehicleFeed::Due> rest(block); !rest.empty();
         rest = rest.subspan(std::min(kTogether, rest.size())))
      compute_and_write(rest.first(std::min(kTogether, rest.size())));
  }

  void compute_and_write(std::span<VehicleFeed::Due> block) {
    std::vector<simulation::ReceiverGroup::Due> epochs;
    epochs.reserve(block.size());
    for (VehicleFeed::Due& each : block) {
      if (vehicles.has_sensors(each.epoch.receiver)) each.epoch.inputs.sensors = &each.samples;
      epochs.push_back(each.epoch);
    }
    const std::vector<ReceiverRunner::Step> steps = receivers.make(epochs, true);
    for (std::size_t i = 0; i < block.size(); ++i) {
      const simulation::Epoch& out = steps[i].epoch;
      ++metrics.epochs;
      metrics.host_s = out.truth.time - clock.start();
      if (out.observed.fix.solved()) ++metrics.fixes;
      if (!out.observed.fix.solved()) {
        metrics.no_fix = fmt::format("{}: {}", names[out.receiver],
                                     encoding::no_fix_reason(out.observed.fix, out.containment));
      } else if (metrics.no_fix.starts_with(names[out.receiver] + ": ")) {
        metrics.no_fix.clear();
      }
      if (!epochs[i].antenna) ++metrics.no_truth;
      for (const auto& stream : streams) stream->write(out);
      corrections.report_position(out);
      for (simulation::EpochSink* sink : *sinks) sink->write(out);
      if (commands) commands->keep(out);
      if (const auto& came = block[i].pose_came)
        metrics.latency.add(std::chrono::duration<double>(Clock::now() - *came).count());
      log_warnings(out.receiver);
    }
  }

  /// Serves all links each 10 ms; wait() serves links with input.
  void serve() {
    if (Clock::now() >= next_service) {
      next_service = Clock::now() + std::chrono::milliseconds(10);
      for (const auto& [address, link] : links) link->serve();
    }
    for (const auto& stream : streams) {
      stream->send_due();
      const std::string line = encoding::apply_commands(*stream, receivers[stream->receiver()]);
      if (!line.empty()) note(fmt::format("{}: {}", names[stream->receiver()], line));
    }
  }

  void once_a_second() {
    if (Clock::now() < next_second) return;
    next_second += std::chrono::seconds(1);
    metrics.poses = vehicles.check_sources();
    note_links();
    if (run_options->progress) run_options->progress(metrics);
  }
  void note_links() const {
    for (const auto& [address, link] : links)
      for (const std::string& line : link->take_notes()) note(fmt::format("{}: {}", address, line));
  }

  /// Serves links and computes due epochs; false at the end of the run.
  [[nodiscard]] bool next_round() {
    round_start = Clock::now();
    serve();
    vehicles.gather(clock.now_ns());
    compute_and_write();
    vehicles.sample_sensors(clock.now_ns());
    once_a_second();
    return !vehicles.ended();
  }

  void wait() {
    const auto next_epoch = vehicles.next_due();
    if (!next_epoch) return;
    // Maximum wait, so that servers accept clients and drivers get their responses.
    Clock::time_point until = std::min(*next_epoch, Clock::now() + std::chrono::milliseconds(20));
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
    const auto left = std::max<std::int64_t>(
        0, std::chrono::duration_cast<std::chrono::nanoseconds>(until - Clock::now()).count());
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
    sky_warnings.take(receivers[receiver], [&](const std::string& line, bool is_sky_warning) {
      warn(is_sky_warning ? line : fmt::format("{}: {}", names[receiver], line));
    });
    for (const std::string& line : corrections.take_warnings(receiver))
      warn(fmt::format("{}: {}", names[receiver], line));
  }

  simulation::Scenario scenario;
  simulation::LiveOptions options;
  std::shared_ptr<simulation::CityScene> scene;
  std::vector<std::string> names;
  std::unique_ptr<simulation::Simulation> trajectory;  // null: poses are external
  transport::Links links;
  std::vector<std::unique_ptr<encoding::EncodedStream>> streams;
  std::vector<propagation::Propagator> prepared;  // that receivers will need
  SkyWarnings sky_warnings;

  // State of a run.
  const SessionOptions* run_options = nullptr;
  const std::vector<simulation::EpochSink*>* sinks = nullptr;
  Clock::time_point next_second, next_service, round_start;
  SessionMetrics metrics;

  // Made in this order, from what is above.
  SessionClock clock;
  simulation::ReceiverGroup receivers;
  CorrectionFeed corrections;
  VehicleFeed vehicles;
  std::unique_ptr<Commands> commands;
};

Session::Session(simulation::Scenario scenario, std::shared_ptr<simulation::CityScene> scene)
    : impl_(std::make_unique<Impl>(std::move(scenario), std::move(scene))) {}
Session::~Session() = default;

geodesy::GpsTime Session::start() const {
  return impl_->clock.start();
}
double Session::interval_s() const {
  return impl_->clock.schedule().interval_s();
}
const simulation::Scenario& Session::scenario() const {
  return impl_->scenario;
}

SessionMetrics Session::run(const std::vector<simulation::EpochSink*>& sinks, const SessionOptions& options) {
  Impl& impl = *impl_;
  impl.run_options = &options;
  impl.sinks = &sinks;
  impl.metrics = {};
  impl.vehicles.begin(
      std::any_of(sinks.begin(), sinks.end(), [](const auto* sink) { return sink->uses_sensors(); }));
  if (const auto first = impl.clock.begin()) impl.vehicles.go_to(*first);
  impl.next_second = Clock::now() + std::chrono::seconds(1);
  for (std::size_t r = 0; r < impl.names.size(); ++r) impl.log_warnings(r);
  impl.note_links();
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
  finish([&] { impl.vehicles.finish(); });
  if (failure) std::rethrow_exception(failure);
  return impl.metrics;
}

}  // namespace canyon::live
