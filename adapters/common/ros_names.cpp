#include "adapters/common/ros_names.hpp"

#include <fmt/format.h>

#include <array>
#include <set>

#include "canyon/base/input_error.hpp"

namespace canyon::adapters {
namespace {

bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

bool is_name_character(char c) {
  return is_letter(c) || (c >= '0' && c <= '9') || c == '_';
}

std::string resolve(std::string_view name, const std::string& base, const std::string& private_base,
                    const std::string& remapping) {
  std::string_view rest = name;
  const std::string* in = &base;
  if (!rest.empty() && rest.front() == '~') {
    in = &private_base;
    rest.remove_prefix(rest.size() > 1 && rest[1] == '/' ? 2 : 1);
    if (!rest.empty() && rest.front() == '/') rest = {};  // "~//x"
  }
  if (!is_ros_name(rest)) {
    throw InputError(
        fmt::format("<ros><remapping>: '{}' in '{}' is not a valid ROS name", name, remapping),
        "write FROM:=TO with names of letters, digits, '_' and '/', such as fix:=gps/fix or ~/out:=scan");
  }
  return rest.front() == '/' ? std::string(rest) : *in + '/' + std::string(rest);
}

/// Link and sensor, or plugin, as a namespace, for topics of several receivers on a model.
std::string node_namespace(const ReceiverIdentity& identity) {
  std::string base;
  std::string_view rest = identity.link;
  while (!rest.empty()) {
    const std::size_t end = rest.find("::");
    base += '/' + ros_name_part(rest.substr(0, end));
    rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 2);
  }
  return base + '/' + ros_name_part(identity.sensor.empty() ? identity.plugin : identity.sensor);
}

}  // namespace

std::string receiver_label(const ReceiverIdentity& identity) {
  std::string name = fmt::format("plugin '{}' of model '{}'", identity.plugin, identity.model);
  if (!identity.sensor.empty()) name += fmt::format(", sensor '{}'", identity.sensor);
  return name;
}

bool is_ros_name(std::string_view name) {
  if (name.empty() || name.back() == '/') return false;
  bool begins_part = true;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const char c = name[i];
    if (c == '/') {
      if (begins_part && i > 0) return false;
      begins_part = true;
    } else if (begins_part ? !is_letter(c) : !is_name_character(c)) {
      return false;
    } else {
      begins_part = false;
    }
  }
  return true;
}

std::vector<std::string> RosTopics::all() const {
  std::vector<std::string> names{fix, fix_velocity, gnss_multipath, satellites, raw_observations};
  if (!scan.empty()) names.push_back(scan);
  return names;
}

std::vector<std::string> RosTopics::claimed() const {
  std::vector<std::string> names = all();
  names.push_back(own);
  return names;
}

std::string ros_name_part(std::string_view name) {
  std::string part(name);
  for (char& c : part)
    if (!is_name_character(c)) c = '_';
  if (part.empty() || !is_letter(part.front())) part.insert(0, "m_");
  return part;
}

std::string ros_namespace(const ReceiverIdentity& identity, const RosSettings& settings) {
  if (settings.ros_namespace.empty()) return '/' + ros_name_part(identity.model);
  std::string_view name = settings.ros_namespace;
  if (name == "/") return {};
  if (name.back() == '/') name.remove_suffix(1);
  if (!is_ros_name(name)) {
    throw InputError(fmt::format("<ros><namespace>: '{}' is not a valid ROS name", settings.ros_namespace),
                     "use letters, digits, '_' and '/', such as /car/gnss");
  }
  return name.front() == '/' ? std::string(name) : '/' + std::string(name);
}

RosTopics ros_topics(const std::string& base, const ReceiverIdentity& identity, const RosSettings& settings,
                     std::vector<std::string>& notes) {
  const std::string private_base = base + '/' + ros_name_part(identity.plugin);
  RosTopics topics;
  topics.base = base;
  topics.own = private_base;
  const std::array<std::pair<const char*, std::string*>, 6> named{
      {{"fix", &topics.fix},
       {"fix_velocity", &topics.fix_velocity},
       {"gnss_multipath", &topics.gnss_multipath},
       {"satellites", &topics.satellites},
       {"raw_observations", &topics.raw_observations},
       {"scan", &topics.scan}}};
  for (const auto& [name, topic] : named) *topic = base + '/' + name;
  for (const auto& [from, to] : settings.remappings) {
    const std::string remapping = fmt::format("{}:={}", from, to);
    const std::string source = resolve(from, base, private_base, remapping);
    const std::string target = resolve(to, base, private_base, remapping);
    bool found = false;
    for (const auto& [name, topic] : named) {
      const bool is_scan = topic == &topics.scan;
      if (source == base + '/' + name || source == private_base + '/' + name ||
          (is_scan && source == private_base + "/out")) {
        *topic = target;
        found = true;
      }
    }
    if (!found) {
      notes.push_back(
          fmt::format("<ros><remapping>: '{}' matches no topic; the topics are fix, fix_velocity, "
                      "gnss_multipath, satellites, raw_observations and scan (also ~/out)",
                      remapping));
    }
  }
  if (!settings.publish_scan) topics.scan.clear();
  std::set<std::string> taken;
  for (const std::string& name : topics.all()) {
    if (!taken.insert(name).second) {
      throw InputError(fmt::format("<ros><remapping>: two topics would both be '{}'", name),
                       "give each topic a different name");
    }
  }
  return topics;
}

RosTopics claimed_ros_topics(const ReceiverIdentity& identity, const RosSettings& settings,
                             const std::function<std::string(const std::vector<std::string>&)>& claim,
                             std::vector<std::string>& notes) {
  RosTopics topics = ros_topics(ros_namespace(identity, settings), identity, settings, notes);
  std::string taken = claim(topics.claimed());
  if (!taken.empty() && settings.ros_namespace.empty()) {
    notes.clear();
    topics = ros_topics(node_namespace(identity), identity, settings, notes);
    const std::string other = std::exchange(taken, claim(topics.claimed()));
    notes.push_back(fmt::format("another receiver uses the ROS name {}; names of this one are in {}", other,
                                topics.base));
  }
  if (!taken.empty()) {
    throw InputError(fmt::format("another receiver already uses the ROS name {}", taken),
                     "give each receiver a different <ros><namespace>");
  }
  return topics;
}

std::string ros_frame_id(const ReceiverIdentity& identity, const RosSettings& settings) {
  if (!settings.frame_id.empty()) return settings.frame_id;
  const std::size_t scope = identity.link.rfind("::");
  return scope == std::string::npos ? identity.link : identity.link.substr(scope + 2);
}

}  // namespace canyon::adapters
