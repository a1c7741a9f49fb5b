#include "adapters/ros2/node_settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "adapters/ros2/rtcm_topic.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/node.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"
#include "canyon/receiver/rtk/correction_link.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::adapters::ros2 {
namespace {

using options::Key;
using options::Node;
using options::Type;
using options::Visitor;

constexpr std::string_view kReceivers = "receivers[].";
constexpr std::size_t kMaxBytes = std::size_t{16} << 20;

void visit_pose(Visitor& v, NodeSettings& settings) {
  static constexpr std::string_view kSources[]{"trajectory", "pose", "odometry", "tf", "fixed"};
  v.choice({"source", "",
            "source of the truth: the scenario's trajectory; geometry_msgs/PoseStamped on the topic pose; "
            "nav_msgs/Odometry on the topic odom; tf2; the receiver's `fixed` position, for a base"},
           settings.pose_source, kSources);
  v.text({"frame", "", "frame of the poses: z up"}, settings.pose_frame);
  v.text({"child_frame", "", "the vehicle's frame, if source is tf"}, settings.child_frame);
  v.number({"east_m", "m", "origin of that frame in the city, from the city's origin: eastwards"},
           settings.pose_origin_enu_m.x(), {-1e6, 1e6});
  v.number({"north_m", "m", "northwards"}, settings.pose_origin_enu_m.y(), {-1e6, 1e6});
  v.number({"up_m", "m", "upwards"}, settings.pose_origin_enu_m.z(), {-1e6, 1e6});
  v.angle({"heading_deg", "deg", "of that frame's x axis, from east counter-clockwise"},
          settings.pose_heading_rad, {-360, 360});
  v.file({"map_projector", "",
          "map_projector_info.yaml of Autoware, if poses are in its map: instead of east_m, north_m, up_m "
          "and heading_deg"},
         settings.map_projector);
  if (!v.reads() || !settings.map_projector) return;
  for (const char* key : {"east_m", "north_m", "up_m", "heading_deg"})
    if (v.has(key))
      throw v.fault(key, "map_projector already defines the map's frame", "remove one of the two");
}

const options::Description& description() {
  return options::description_of<NodeSettings>();
}

std::vector<Key> make_keys() {
  std::vector<Key> keys;
  std::set<std::string> names;
  const auto add = [&](bool receivers) {
    std::vector<Key> all = description().keys;
    for (const auto& former : description().former_names) {
      Key key =
          *std::find_if(all.begin(), all.end(), [&](const Key& each) { return each.path == former.second; });
      key.path = former.first;
      key.meaning = fmt::format("former name of {}", former.second);
      all.push_back(std::move(key));
    }
    for (Key& key : all) {
      if (key.path.starts_with(kReceivers) != receivers) continue;
      if (receivers) key.path.erase(0, kReceivers.size());
      const bool is_from_file = key.path.find("[]") != std::string::npos || key.type == Type::Rows ||
                                key.path.starts_with("outputs");
      // Some keys are both at the top of a scenario and in its receivers; here there is one receiver.
      if (!is_from_file && names.insert(key.path).second) keys.push_back(std::move(key));
    }
  };
  add(true);
  add(false);
  return keys;
}

/// The value as text for readers; the texts of a list one by one. Empty: not given.
std::optional<Node> node_of(const ParameterValue& value) {
  using options::scalar_node;
  const auto list = [](const auto& items, const auto& text) -> std::optional<Node> {
    if (items.empty()) return std::nullopt;
    Node node;
    node.kind = Node::Kind::List;
    for (const auto& item : items) node.items.push_back(scalar_node(text(item)));
    return node;
  };
  if (const auto* flag = std::get_if<bool>(&value)) return scalar_node(*flag ? "true" : "false");
  if (const auto* integer = std::get_if<std::int64_t>(&value))
    return scalar_node(fmt::format("{}", *integer));
  if (const auto* number = std::get_if<double>(&value)) return scalar_node(options::show(*number));
  if (const auto* text = std::get_if<std::string>(&value)) {
    if (text->empty()) return std::nullopt;
    return scalar_node(*text);
  }
  if (const auto* numbers = std::get_if<std::vector<double>>(&value)) return list(*numbers, options::show);
  if (const auto* texts = std::get_if<std::vector<std::string>>(&value))
    return list(*texts, [](const std::string& text) { return text; });
  return std::nullopt;
}

/// The value of a key in a mapping; created if missing.
Node& child_of(Node& mapping, std::string_view key) {
  mapping.kind = Node::Kind::Mapping;
  const auto at = std::find_if(mapping.entries.begin(), mapping.entries.end(),
                               [key](const Node::Entry& entry) { return entry.key == key; });
  if (at != mapping.entries.end()) return at->value;
  mapping.entries.push_back({std::string(key), mapping.line, {}});
  return mapping.entries.back().value;
}

/// Removes faults of other receivers. @param base name of the kept base; empty: none
void only_faults_of(Node& root, const Node& receiver, const std::string& base) {
  const auto list = std::find_if(root.entries.begin(), root.entries.end(),
                                 [](const Node::Entry& entry) { return entry.key == "faults"; });
  if (list == root.entries.end()) return;
  const Node::Entry* name = receiver.find("name");
  const std::string own = name == nullptr ? "rover" : name->value.text;
  for (Node& fault : list->value.items) {
    const auto named = std::find_if(fault.entries.begin(), fault.entries.end(),
                                    [](const Node::Entry& entry) { return entry.key == "receivers"; });
    if (named == fault.entries.end()) continue;
    std::vector<Node>& names = named->value.items;
    std::erase_if(names, [&](const Node& each) { return each.text != own && each.text != base; });
    const bool stays = !names.empty() || named->value.text == own || named->value.text == base;
    if (stays && base.empty())
      fault.entries.erase(named);  // there is only one receiver here
    else if (!stays)
      fault.kind = Node::Kind::Empty;
  }
  std::vector<Node>& faults = list->value.items;
  const bool any = !faults.empty();
  std::erase_if(faults, [](const Node& fault) { return fault.kind == Node::Kind::Empty; });
  if (any && faults.empty()) root.entries.erase(list);
}

/// Keeps one receiver of the tree (created if there is none), followed by its base.
/// @param base the receiver's source of corrections; empty: from its own keys
void only_receiver(Node& root, const std::string& name, std::string base) {
  Node& receivers = child_of(root, "receivers");
  if (receivers.kind == Node::Kind::Empty) receivers.kind = Node::Kind::List;
  if (receivers.items.empty()) receivers.items.emplace_back().kind = Node::Kind::Mapping;
  if (!name.empty()) {
    std::vector<std::string> names;
    const auto at = std::find_if(receivers.items.begin(), receivers.items.end(), [&](const Node& item) {
      const Node::Entry* entry = item.find("name");
      names.push_back(entry == nullptr ? "rover" : entry->value.text);
      return names.back() == name;
    });
    if (at == receivers.items.end()) {
      throw InputError(fmt::format("parameter 'receiver': the scenario has no receiver '{}'", name),
                       fmt::format("it has {}", fmt::join(names, ", ")));
    }
    std::swap(*at, receivers.items.front());
  }
  std::vector<Node>& items = receivers.items;
  if (base.empty()) {
    const Node::Entry* corrections = items.front().find("corrections");
    const Node::Entry* from = corrections == nullptr ? nullptr : corrections->value.find("from");
    if (from != nullptr) base = from->value.text;
  }
  const auto named = std::find_if(items.begin() + 1, items.end(), [&base](const Node& item) {
    const Node::Entry* entry = item.find("name");
    return entry != nullptr && !base.empty() && entry->value.text == base;
  });
  const bool has_base = named != items.end();
  if (has_base) std::iter_swap(items.begin() + 1, named);
  items.resize(has_base ? 2 : 1);
  only_faults_of(root, items.front(), has_base ? base : "");
}

bool is_file(const std::string& name) {
  const Key* key = find_parameter(name);
  return key != nullptr && (key->type == Type::File || key->type == Type::Files);
}

void put(Node& root, const std::string& name, Node value) {
  const auto absolute = [](Node& node) { node.text = std::filesystem::absolute(node.text).string(); };
  if (is_file(name)) {
    if (value.kind == Node::Kind::Scalar) absolute(value);
    for (Node& item : value.items) absolute(item);
  }
  Node* at = is_receivers(name) ? &child_of(root, "receivers").items.front() : &root;
  for (const std::string_view part : split(name, '.')) {
    // `start: TEXT` is replaced by start.week, and so on.
    if (at->kind != Node::Kind::Mapping) *at = {};
    at = &child_of(*at, part);
  }
  *at = std::move(value);
}

void check_topics(const Visitor& v, const NodeSettings& settings) {
  try {
    for (const std::string& stream : settings.streams) (void)topic_of_stream(stream);
  } catch (const InputError& e) {
    throw v.fault("streams", e.problem(), e.hint());
  }
  const std::string& from = settings.live.receiver().options.corrections.from;
  try {
    if (!rtk::is_stream(from) || topic_of(from)) return;
  } catch (const InputError& e) {
    throw v.fault("corrections.from", e.problem(), e.hint());
  }
  throw v.fault(
      "corrections.from", fmt::format("'{}' is a stream, which a ROS 2 node cannot read", from),
      "name a base, a second receiver of the scenario, or a topic, topic:NAME, or run it with canyon "
      "live");
}

void check_fixed(const Visitor& v, const NodeSettings& settings) {
  const bool fixed = settings.live.receiver().fixed.has_value();
  if (settings.pose_source == PoseSource::Fixed && !fixed) {
    throw v.fault("pose.source", "the receiver has no fixed position",
                  "give it fixed.latitude_deg, fixed.longitude_deg and fixed.height_m, or fixed.east_m, "
                  "fixed.north_m and fixed.up_m");
  }
  if (settings.pose_source != PoseSource::Fixed && settings.is_pose_driven() && fixed) {
    throw v.fault("pose.source", "poses would move the receiver, which is fixed",
                  "set pose.source: fixed, or remove fixed");
  }
}

/// Values by path, without lists of mappings.
void flatten(const Node& node, const std::string& path, Parameters& into);

ParameterValue value_of(const Node& node, const Key& key) {
  std::vector<std::string> texts;
  for (const Node& item : node.items) texts.push_back(item.text);
  if (node.kind == Node::Kind::Scalar) texts.push_back(node.text);
  switch (key.type) {
    case Type::Boolean:
      return node.text == "true";
    case Type::Integer:
      if (const auto integer = parse_integer(node.text)) return std::int64_t{*integer};
      return node.text;
    case Type::Number:
      if (const auto number = parse_double(node.text)) return *number;
      return node.text;  // "none"
    case Type::Texts:
    case Type::Files:
      return texts;
    case Type::Numbers: {
      std::vector<double> numbers(texts.size());
      std::transform(texts.begin(), texts.end(), numbers.begin(),
                     [](const std::string& text) { return parse_double(text).value_or(std::nan("")); });
      return numbers;
    }
    default:
      return node.text;
  }
}

void flatten(const Node& node, const std::string& path, Parameters& into) {
  if (node.kind == Node::Kind::Mapping) {
    for (const Node::Entry& entry : node.entries)
      flatten(entry.value, path.empty() ? entry.key : path + "." + entry.key, into);
  } else if (path == "receivers") {
    if (!node.items.empty()) flatten(node.items.front(), "", into);  // its base is only in the file
  } else if (const Key* key = find_parameter(path); key != nullptr && node.kind != Node::Kind::Empty) {
    into[path] = value_of(node, *key);
  }
}

}  // namespace

std::string NodeSettings::corrections_topic() const {
  return topic_of(live.receiver().options.corrections.from).value_or("");
}

void visit(Visitor& v, NodeSettings& settings) {
  v.file({"scenario", "", "scenario file; parameters override it"}, settings.scenario);
  v.text({"receiver", "", "which of its receivers", "its first"}, settings.receiver);
  v.boolean({"autostart", "", "configures and activates itself"}, settings.autostart);
  v.boolean({"diagonal_covariance", "",
             "fixes report only variances, without covariances of east, north and up, as most drivers do"},
            settings.diagonal_covariance);
  v.boolean({"drive_clock", "", "publish /clock from 0, and use it"}, settings.drive_clock);
  v.number({"speed", "", "of the clock that it drives, relative to real time"}, settings.speed,
           {0, 1000, true});
  live::visit_host(v, settings, settings.frame_id, [&] { visit_pose(v, settings); });
  simulation::ScenarioOfAnyTrajectory any{settings.live};
  visit(v, any);
  if (!v.reads()) return;
  check_topics(v, settings);
  check_fixed(v, settings);
  // The base's signals have the errors removed by corrections, as in a scenario with the rover.
  if (settings.pose_source == PoseSource::Fixed ||
      std::any_of(settings.streams.begin(), settings.streams.end(),
                  [](const std::string& stream) { return topic_of_stream(stream).has_value(); }))
    settings.live.sky.errors.enabled.set_default(true);
  if (!settings.is_pose_driven()) {
    v.require("trajectory", "add trajectory: {file: ...}, waypoints or position, or set pose.source");
  } else if (settings.drive_clock) {
    throw v.fault("drive_clock", "external poses have their own time",
                  "remove it, or take the truth from the scenario's trajectory");
  }
}

const std::vector<Key>& parameter_keys() {
  static const std::vector<Key> keys = make_keys();
  return keys;
}

std::vector<Key> node_keys() {
  const std::vector<std::string> scenarios = simulation::scenario_description().paths();
  std::vector<Key> own = parameter_keys();
  std::erase_if(own, [&](const Key& key) {
    return is_receivers(key.path) || description().current(key.path) != key.path ||
           std::find(scenarios.begin(), scenarios.end(), key.path) != scenarios.end();
  });
  return own;
}

const Key* find_parameter(const std::string& name) {
  const std::vector<Key>& keys = parameter_keys();
  const auto at = std::find_if(keys.begin(), keys.end(), [&](const Key& key) { return key.path == name; });
  return at == keys.end() ? nullptr : &*at;
}

std::string meant_parameter(const std::string& name) {
  std::vector<std::string> names;
  for (const Key& key : parameter_keys()) names.push_back(key.path);
  return did_you_mean(options::closest_key(name, names), "see docs/ros2.md for their names");
}

bool is_receivers(const std::string& name) {
  const std::vector<std::string> paths = description().paths();
  const std::string path = description().current(std::string(kReceivers) + name);
  return std::find(paths.begin(), paths.end(), path) != paths.end();
}

NodeSettings read_settings(const Parameters& given) {
  options::Document document;
  document.set_keys(description());
  document.fault = [&](const std::string& path, const std::string& key, int line, std::string_view problem,
                       std::string_view hint) {
    std::string name = path.empty() ? key : key.empty() ? path : path + "." + key;
    if (name.starts_with(kReceivers)) name.erase(0, kReceivers.size());
    if (given.contains(name)) return InputError(fmt::format("parameter '{}': {}", name, problem), hint);
    return InputError(document.file, line,
                      key.empty() ? std::string(problem) : fmt::format("{}: {}", key, problem), hint);
  };

  const auto text_of = [&given](const std::string& name) {
    const auto at = given.find(name);
    const auto* text = at == given.end() ? nullptr : std::get_if<std::string>(&at->second);
    return text == nullptr ? std::string() : *text;
  };
  NodeSettings settings;
  Node root;
  root.kind = Node::Kind::Mapping;
  if (const std::string file = text_of("scenario"); !file.empty()) {
    document.file = file;
    const TextFile text(file, kMaxBytes);
    root = options::parse_yaml(std::string(text.text()), document, "add at least city and trajectory");
    settings.live.file = file;
  }
  if (root.kind == Node::Kind::Mapping) {
    only_receiver(root, text_of("receiver"), text_of("corrections.from"));
    for (const auto& [name, value] : given) {
      const auto node = node_of(value);
      if (!node) continue;
      if (find_parameter(name) == nullptr)
        throw InputError(fmt::format("there is no parameter '{}'", name), meant_parameter(name));
      put(root, name, *node);
    }
    settings.named = root.find("receivers")->value.items.front().find("name") != nullptr;
  }
  options::read(root, document, settings);
  return settings;
}

Parameters parameters_of(const NodeSettings& settings) {
  options::Document document;
  Parameters parameters;
  flatten(options::parse_yaml(options::yaml(settings), document, ""), "", parameters);
  // The written text names no profile, since it has all keys.
  parameters.erase("profile");
  return parameters;
}

simulation::Scenario simulated_world(const NodeSettings& settings) {
  simulation::Scenario world = settings.live;
  std::string& from = world.receivers.front().options.corrections.from;
  if (topic_of(from)) from.clear();
  return world;
}

simulation::RunnerConfig driven_config(const NodeSettings& settings, const std::string& receiver_name,
                                       const simulation::Simulation* drive) {
  simulation::RunnerConfig config = settings.live;
  if (drive != nullptr) {
    config.start = drive->begin();
    config.rate_hz = 1 / drive->interval_s();
    config.with_sensors = config.sensors.any() && !config.receiver().fixed;
    config.warnings.clear();  // the simulation logs them
    return config;
  }
  config.receiver().options.independent_noise = true;
  if (!settings.named) config.receiver().options.name = receiver_name;
  return config;
}

}  // namespace canyon::adapters::ros2
