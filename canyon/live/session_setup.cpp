// Declared in canyon/live/session_impl.hpp.
#include "canyon/base/gzip_file.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/live/session_impl.hpp"

namespace canyon::live {
namespace {

constexpr std::string_view kTrajectory = "trajectory";
constexpr std::string_view kFile = "file:";

}  // namespace

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
    simulation::Scenario of_trajectory = scenario;
    for (simulation::ReceiverConfig& receiver : of_trajectory.receivers) {
      if (relative::is_stream(receiver.options.corrections.from)) receiver.options.corrections.from.clear();
    }
    trajectory = std::make_unique<simulation::Simulation>(std::move(of_trajectory), scene);
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
                "have one source with all vehicles' poses in their order, or take the wall clock");
  }
  if (real && options.speed != 1) {
    throw error(fmt::format("live.speed is {}, and poses come in real time", options.speed),
                "leave it out; it is for trajectories and logs");
  }
}

void Session::Impl::make_receivers() {
  corrections.emplace(scenario.receivers, scenario.seed);
  std::shared_ptr<const simulation::BuiltSky> sky;
  for (std::size_t r = 0; r < scenario.receivers.size(); ++r) {
    simulation::LiveConfig config = simulation::live_config(scenario, r, start, schedule.interval_s());
    config.with_sensors = scenario.sensors.any();
    receivers.emplace_back(std::move(config), scene, start, sky);
    sky = receivers.back().shared_sky();
    // Prepared now, so that the first epoch is not late.
    prepared.push_back(
        receivers.back().environment().make_propagator(receivers.back().config().receiver().propagation));
  }
}

std::shared_ptr<transport::Link> Session::Impl::link_of(const std::string& address) {
  std::shared_ptr<transport::Link>& link = links[address];
  if (!link) link = std::make_shared<transport::Link>(address);
  return link;
}

void Session::Impl::make_inputs() {
  inputs.resize(receivers.size());
  for (std::size_t r = 0; r < receivers.size(); ++r) {
    const std::string& address = scenario.receivers[r].options.corrections.from;
    if (!relative::is_stream(address)) continue;
    if (address.starts_with(relative::kTopicAddress)) {
      throw error(
          fmt::format("receiver '{}' takes corrections from '{}', a topic of ROS 2", names[r], address),
          "run it as a node of ROS 2 (docs/ros2.md), or name a caster, "
          "ntrip://USER:PASSWORD@HOST:PORT/MOUNT");
    }
    inputs[r] = std::make_unique<CorrectionInput>(
        CorrectionInput{RtcmInput(scenario.receivers[r].options, scenario.seed), nullptr, std::nullopt});
    if (address.starts_with("ntrip://")) inputs[r]->caster = link_of(address);
    (void)link_of(address)->listen(
        [this, r](const transport::Received& received) { inputs[r]->input.receive(received.bytes, now()); });
  }
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
    const std::int64_t offset_ns =
        options.stagger ? schedule.interval_ns() * static_cast<std::int64_t>(r) / n : 0;
    vehicle.receivers.push_back({r, schedule.behind(offset_ns)});
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
    vehicle.source = std::make_unique<PoseSource>(source, scene->city.frame, scene->city.geoid_undulation_m);
    if (source.from.starts_with(kFile)) {
      vehicle.log.emplace();
      vehicle.log->text = read_bytes(source.from.substr(kFile.size()));
      continue;
    }
    const bool shared = std::any_of(options.streams.begin(), options.streams.end(),
                                    [&](const auto& stream) { return stream.address == source.from; });
    if (source.from.starts_with("udp://") && !shared && vehicle.source->request().empty()) {
      throw error(
          fmt::format("live.poses: '{}' is an address to send to, and no pose comes from there", source.from),
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
          [&] { return begin_anew(self); });
    });
  }
  for (std::size_t r = 0; r < names.size(); ++r) {
    if (driver[r] != nullptr) continue;
    if (scenario.receivers[r].fixed) {
      vehicles.emplace_back().receivers.push_back({r, schedule});
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
          scenario.receivers[r], *sky.sky, sky.navigation, start, schedule.interval_s());
      description.sensors = scenario.sensors.any();
      streams.push_back(output::open_stream(request, r, description, link_of(request.address)));
    } catch (const InputError& e) {
      if (!e.file().empty()) throw;
      throw error(fmt::format("live.streams[{}]: {}", i, e.problem()), e.cure());
    }
  }
  if (options.control.empty()) return;
  CommandContext context{scenario, receivers, figures, options.changes, [this] { return seconds(now_ns()); }};
  commands = make_commands(std::move(context), link_of(options.control));
}

}  // namespace canyon::live
