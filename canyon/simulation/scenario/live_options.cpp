#include "canyon/simulation/scenario/live_options.hpp"

#include <fmt/format.h>

#include <string_view>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/node.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/receiver/rtk/correction_link.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/scenario/scenario_fields.hpp"

namespace canyon::simulation {

void visit(options::Visitor& v, StreamOptions& o) {
  v.number({"rate_hz", "Hz", "rate of the sent epochs", "every epoch"}, o.rate_hz, {0, 1000, true});
  v.number({"latency_s", "s", "delay from epoch to bytes, in real time; receivers have 0.05 to 0.2"},
           o.latency_s, {0, 10});
  v.number({"jitter_s", "s", "standard deviation of the latency"}, o.jitter_s, {0, 1});
  v.number(
      {"link_baud", "baud",
       "speed of a slow link in the path, ten bits a byte: an epoch's messages arrive one after the other",
       "at once"},
      o.link_baud, {300, 1e9});
  v.boolean(
      {"ephemerides", "",
       "rtcm and gps_rtcm_data: with the satellites' ephemerides (messages 1019, 1020, 1042, 1044 to 1046); "
       "false: for radio links, where the rover reads them from the satellites"},
      o.ephemerides);
  v.boolean(
      {"virtual_station", "",
       "rtcm: a network's virtual reference station: each client gets corrections for the position in its "
       "own GGA sentences, and nothing before the first one"},
      o.virtual_station);
  visit_generation(v, o.generation);
}

void visit(options::Visitor& v, StreamRequest& o) {
  v.text({"receiver", "", "name of the receiver; required with several receivers"}, o.receiver);
  v.text({"format", "", "nmea, ubx and others: 'canyon simulate --help' lists them"}, o.format);
  v.text({"to", "", "an address: docs/outputs.md lists them"}, o.address);
  visit(v, o.options);
  if (!v.reads()) return;
  v.require("format");
  v.require("to");
}

void visit(options::Visitor& v, PoseSourceOptions& o) {
  static constexpr std::string_view kFormats[]{"json", "binary", "mavlink"};
  static constexpr std::string_view kAxes[]{"enu", "ned"};
  static constexpr std::string_view kBody[]{"flu", "frd"};
  v.text({"from", "",
          "source of poses: trajectory (the scenario's), file:PATH (a log), or an address to listen at, such "
          "as udp-listen://127.0.0.1:14560 or stdin:"},
         o.from);
  v.choice({"format", "", "format of poses: json (a line each), binary or mavlink"}, o.format, kFormats);
  v.text({"id", "", "id of the vehicle if several send to this address (mavlink: number of the system)"},
         o.id);
  v.texts({"receivers", "", "receivers on this vehicle", "all that no other source lists"}, o.receivers);
  v.texts({"messages", "", "MAVLink messages to use",
           "SIM_STATE, HIL_STATE_QUATERNION, ATT_POS_MOCAP, VISION_POSITION_ESTIMATE, ODOMETRY"},
          o.messages);
  v.choice({"axes", "", "axes of positions and velocities: enu or ned (mavlink: given by the message)"},
           o.axes, kAxes);
  v.choice({"body", "", "axes of attitudes and angular rates: flu or frd"}, o.body, kBody);
  v.number({"east_m", "m", "origin of the poses in the city, east"}, o.origin_enu_m.x(), {-1e6, 1e6});
  v.number({"north_m", "m", "origin of the poses in the city, north"}, o.origin_enu_m.y(), {-1e6, 1e6});
  v.number({"up_m", "m", "origin of the poses in the city, up"}, o.origin_enu_m.z(), {-1e5, 1e5});
  v.angle({"heading_deg", "deg", "direction of the poses' first axis in ENU, from east counter-clockwise"},
          o.heading_rad, {-360, 360});
  v.number({"scale", "", "metres in the city for one unit of the poses"}, o.scale, {1e-3, 1e4});
  v.number({"timeout_s", "s",
            "the last motion is continued for this time after the last pose; then there is no truth and no "
            "signal"},
           o.track.timeout_s, {0.01, 60});
  v.number({"smoothing_s", "s",
            "if poses have no velocities: time over which positions are differenced; steps, of at least 0.04 "
            "s, of the sensors' motion"},
           o.track.smoothing_s, {0, 1});
}

void visit(options::Visitor& v, LiveOptions& o) {
  static constexpr std::string_view kClocks[]{"wall", "stamps"};
  v.list("poses", o.poses, [&](PoseSourceOptions& source) { visit(v, source); });
  v.list("streams", o.streams, [&](StreamRequest& stream) { visit(v, stream); });
  v.choice({"clock", "", "clock of the run: wall (real time) or stamps (time stamps of the poses)"}, o.clock,
           kClocks);
  v.number({"speed", "", "speed of the trajectory and of logs: their seconds per second of real time"},
           o.speed, {0.01, 1000});
  v.number({"wait_s", "s",
            "time for which an epoch waits for a pose of its instant; then the last pose is extrapolated"},
           o.wait_s, {0, 1});
  v.boolean({"stagger", "", "distribute the receivers' epochs evenly over the interval"}, o.stagger);
  v.boolean({"resume", "",
             "take the run's time from the poses' stamps, so that a restarted program continues at the "
             "vehicle's time"},
            o.resume);
  v.text({"control", "", "address for commands, such as tcp://127.0.0.1:7878"}, o.control);
  v.boolean({"changes", "", "commands may change the simulation"}, o.changes);
}

namespace {

void warn_of_idle_noise(const options::Visitor& v, RunnerConfig& config) {
  if (v.reads() && v.has("noise") && has_idle_noise(config.sky, config.receiver()))
    config.warnings.push_back(idle_noise_warning({}));
}

/// The fields that may change while a receiver runs.
struct RunningConfig {
  RunnerConfig& live;
};

void visit(options::Visitor& v, RunningConfig& config) {
  ReceiverConfig& receiver = config.live.receiver();
  visit_rate(v, config.live.rate_hz);
  visit_seed(v, config.live.seed);
  if (v.describes()) visit_profile(v, receiver);
  if (v.has("profile")) {
    const ReceiverConfig before = receiver;
    visit_profile(v, receiver);
    receiver.options.name = before.options.name;
    receiver.options.independent_noise = before.options.independent_noise;
    receiver.options.corrections.from = before.options.corrections.from;
    receiver.options.signal.shadowing = before.options.signal.shadowing;
    receiver.streets = before.streets;
    receiver.lever_arm_m = before.lever_arm_m;
    receiver.disturbances = before.disturbances;
    receiver.models = before.models;
  }
  visit(v, receiver);
  v.part("streets", receiver.streets);
  v.validate(receiver.options);
  warn_of_idle_noise(v, config.live);
}

/// The base's own keys; all others are from a profile.
void visit_base(options::Visitor& v, RunnerConfig& config) {
  if (!v.wants(v.reads() ? v.has("base") : config.base() != nullptr)) return;
  ReceiverConfig base = config.base() != nullptr ? *config.base() : ReceiverConfig{};
  // East and north are relative to the host's origin, which ReceiverRunner has.
  const CityConfig host_city;
  v.section("base", [&] {
    std::optional<std::string> name;
    if (!v.reads()) name = base.options.name;
    v.text({"name", "", "name of a base station in the host's world, computed with the receiver", "base"},
           name);
    if (v.reads() && name) options::check_folder_name(v, "name", *name);
    visit_profile(v, base);
    if (v.reads()) base.options.name = name.value_or("base");
    if (v.reads()) v.require("fixed", "give its position: fixed: {east_m: ..., north_m: ..., up_m: ...}");
    visit_fixed(v, base.fixed, host_city);
    if (!v.reads()) return;
    base.options.independent_noise = true;
    config.receivers.resize(1);
    config.receivers.push_back(base);
    if (base.options.name == config.receiver().options.name)
      throw v.fault("name", fmt::format("'{}' is the name of the receiver", base.options.name),
                    "give the base another name");
  });
}

void check_base(options::Visitor& v, const RunnerConfig& config) {
  if (!v.reads()) return;
  const std::string& from = config.receiver().options.corrections.from;
  v.section("corrections", [&] {
    if (rtk::is_stream(from))
      throw v.fault("from", fmt::format("'{}' is a stream, which hosts do not read", from),
                    "run it by canyon live, or give a base: {fixed: ...} and use its name");
    if (config.allow_external_base && config.base() == nullptr) return;
    try {
      check_corrections(config.receivers, 0);
    } catch (const InputError& e) {
      throw v.fault("from", e.problem(), config.base() != nullptr ? e.hint() : "add base: {fixed: ...}");
    }
  });
}

}  // namespace

void visit(options::Visitor& v, RunnerConfig& config) {
  if (v.reads() && !v.has("sky")) config.sky.nominal = true;
  v.part("sky", config.sky);
  visit_start(v, config.start, &config.warnings);
  visit_rate(v, config.rate_hz);
  visit_seed(v, config.seed);
  v.number(
      {"geoid_undulation_m", "m",
       "height of mean sea level above the ellipsoid in the world, subtracted in NMEA, UBX, MAVLink and GPX",
       "the city's, else 0"},
      config.city.sea_level.geoid_undulation_m, {-150, 150});
  ReceiverConfig& receiver = config.receiver();
  visit_name_and_profile(v, receiver, false);
  // A host's receivers may be on several vehicles with different errors.
  if (v.reads() || v.describes()) receiver.options.independent_noise = true;
  if (v.describes()) receiver.options.signal.shadowing.environment = disturbance::ShadowingEnvironment::Auto;
  disturbance::visit_environment(v, "surroundings", receiver.options.signal.shadowing.environment);
  visit(v, receiver);
  v.part("streets", receiver.streets);
  visit_base(v, config);
  // Settings for all receivers of a world name their base; the base itself uses no corrections.
  std::string& from = receiver.options.corrections.from;
  if (v.reads() && config.allow_external_base && from == receiver.options.name) from.clear();
  if (v.reads() && has_base(config.receiver().options)) config.sky.errors.enabled.set_default(true);
  warn_of_idle_noise(v, config);
  v.validate(config.receiver().options);
  check_base(v, config);
}

RunnerConfig live_config(const Scenario& scenario, geodesy::GpsTime start, double interval_s) {
  RunnerConfig config(scenario);
  config.start = start;
  config.rate_hz = 1 / interval_s;
  config.warnings.clear();
  config.live.reset();  // of the host, not of each receiver
  return config;
}

namespace {

/// With the list of mappings, which settings of SDF and ROS cannot contain.
struct RunnerConfigWithFaults : RunnerConfig {};

void visit(options::Visitor& v, RunnerConfigWithFaults& config) {
  visit(v, static_cast<RunnerConfig&>(config));
  disturbance::visit_faults(v, config.faults, receiver_names(config.receivers));
}

}  // namespace

RunnerConfig parse_live_config(const std::string& text, const std::filesystem::path& name) {
  RunnerConfigWithFaults config;
  options::read_yaml(text, document_of(name), "it needs at least a key of a receiver", config);
  return config;
}

const options::Description& running_description() {
  static const options::Description description = [] {
    RunnerConfig defaults;
    return options::describe(RunningConfig{defaults});
  }();
  return description;
}

std::string running_options(const RunnerConfig& config) {
  return hide_passwords(
      options::dotted(RunningConfig{const_cast<RunnerConfig&>(config)}));  // changes nothing
}

RunnerConfig changed_live_config(const RunnerConfig& config, const std::string& text,
                                 const std::filesystem::path& name) {
  options::Document document = document_of(name, "change");
  document.set_keys(running_description());
  const options::Node root =
      options::without_dots(options::parse_yaml(text, document, "write KEY: VALUE"), document);
  for (const char* fixed : {"name", "sky", "start", "base", "geoid_undulation_m"}) {
    const options::Node::Entry* entry = root.find(fixed);
    if (entry == nullptr) continue;
    throw InputError(name, entry->line, fmt::format("{}: cannot change while the receiver runs", fixed),
                     "set it in the receiver's configuration, and restart");
  }
  // A request may name profiles of Canyon, and files in the scenario's folder, but no other files.
  const options::Node::Entry* profile = root.find("profile");
  if (profile != nullptr && !name.empty() && is_profile_path(profile->value.text)) {
    const std::filesystem::path file = std::filesystem::path(profile->value.text).lexically_normal();
    if (!name.has_parent_path() || file.has_parent_path() ||
        !std::filesystem::is_regular_file(std::filesystem::symlink_status(name.parent_path() / file))) {
      throw InputError(name, profile->line,
                       fmt::format("profile: '{}' is not in the scenario's folder", profile->value.text),
                       "name one of 'canyon profiles', or a file without its folder: my.yaml");
    }
  }
  RunnerConfig changed = config;
  changed.warnings.clear();
  RunningConfig running{changed};
  options::read(root, document, running);
  std::string& from = changed.receiver().options.corrections.from;
  const std::string& before = config.receiver().options.corrections.from;
  if (from == hide_passwords(before)) from = before;  // as in running_options()
  if (from != before) {
    throw InputError(name, root.find("corrections")->line,
                     "corrections.from: cannot change while the receiver runs",
                     "set it in the receiver's configuration, and restart");
  }
  return changed;
}

}  // namespace canyon::simulation
