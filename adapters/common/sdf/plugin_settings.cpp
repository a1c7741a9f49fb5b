#include "adapters/common/sdf/plugin_settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

#include "adapters/common/sdf/plugin_elements.hpp"
#include "adapters/common/sdf/resource_files.hpp"
#include "canyon/base/text.hpp"
#include "canyon/output/stream.hpp"
#include "canyon/propagation/propagator.hpp"
#include "canyon/simulation/profile.hpp"

namespace canyon::adapters {
namespace {

using Element = PluginElements::Element;

// Elements of other plugins that users exchange for this one; they are known, to be told what serves instead.
struct Foreign {
  const char* path;
  const char* instead;
  bool px4;
};
constexpr const char* kPx4Noise =
    "<noise><sigma_m_per_sqrt_s> and <noise><theta_per_s> shape the noise of pseudoranges here, "
    "<noise><doppler_sigma_hz> that of velocity";
constexpr const char* kPx4Home =
    "the world's spherical_coordinates, or <origin_latitude>, <origin_longitude> and <origin_altitude>, say "
    "the "
    "origin here";
constexpr Foreign kForeign[] = {
    {"offsetTopicName", "the offsets are in range_offset of the ROS topic gnss_multipath", false},
    {"satRayTopicName", "<visuals><rays>true</rays></visuals> shows the rays", false},
    {"errorScale", "errors are in metres as they are; <visuals><bubble_scale> scales what is shown of them",
     false},
    {"gpsXYRandomWalk", kPx4Noise, true},
    {"gpsZRandomWalk", kPx4Noise, true},
    {"gpsXYNoiseDensity", kPx4Noise, true},
    {"gpsZNoiseDensity", kPx4Noise, true},
    {"gpsVXYNoiseDensity", kPx4Noise, true},
    {"gpsVZNoiseDensity", kPx4Noise, true},
    {"homeLatitude", kPx4Home, true},
    {"homeLongitude", kPx4Home, true},
    {"homeAltitude", kPx4Home, true},
};

std::vector<std::string> known_paths() {
  std::vector<std::string> known;
  for (const simulation::ScenarioKey& key : plugin_keys()) known.push_back(key.path);
  for (const Foreign& foreign : kForeign) known.emplace_back(foreign.path);
  return known;
}

// The key overrides the field where it is there.
template <typename T>
void set(T& field, std::optional<T> value) {
  if (value) field = *std::move(value);
}

// True where an element of PX4's gps plugin stands.
bool read_foreign(PluginElements& elements, std::vector<std::string>& warnings) {
  bool px4 = elements.has("gpsNoise");
  std::vector<std::pair<std::string, std::string_view>> ignored;  // tags, what serves instead
  for (const Foreign& foreign : kForeign) {
    const auto element = elements.take(foreign.path);
    if (!element) continue;
    px4 = px4 || foreign.px4;
    const std::string_view instead = foreign.instead;
    if (!ignored.empty() && ignored.back().second == instead) {
      // One warning for all that one answer serves.
      ignored.back().first += ", " + element->tag;
    } else {
      ignored.emplace_back(element->tag, instead);
    }
  }
  for (const auto& [tags, instead] : ignored)
    warnings.push_back(fmt::format("{} without effect: {}", tags, instead));
  return px4;
}

void rename(PluginElements& elements, const char* from, const char* to) {
  if (auto element = elements.take(from)) {
    if (element->values.front().empty()) return;
    element->path = to;
    elements.put(*std::move(element));
  }
}

// The paper's names for keys of the scenario; true where its satellites stand.
bool read_papers_names(PluginElements& elements) {
  const bool paper = elements.has("satAzimuth");
  for (const char* name : {"satNum", "satAzimuth", "satElevation"}) {
    rename(elements, name, fmt::format("sky.frozen.{}", name).c_str());
  }
  if (auto element = elements.take("disableNoise")) {
    elements.put(*element);
    const bool disabled = *elements.boolean("disableNoise");
    elements.put({"noise.enabled", element->tag, {disabled ? "false" : "true"}});
  }
  rename(elements, "gpsNoise", "noise.enabled");
  rename(elements, "update_rate", "rate_hz");
  if (paper && !elements.has("propagation.model")) {
    elements.put({"propagation.model", "<satAzimuth>", {"mirror"}});
  }
  return paper;
}

// ROS names: letters, digits, '_' and '/', a letter first; '/' or '~' may stand in front of it.
bool is_ros_name(std::string_view name) {
  if (name.empty()) return false;
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  if (!is_letter(name.front()) && name.front() != '/' && name.front() != '~') return false;
  return std::all_of(name.begin() + 1, name.end(),
                     [&](char c) { return is_letter(c) || (c >= '0' && c <= '9') || c == '_' || c == '/'; });
}
constexpr const char* kRosNameCure =
    "ROS names have letters, digits, '_' and '/', and begin with a letter, '/' or '~'";

void read_ros(PluginElements& elements, PluginSettings& settings) {
  rename(elements, "robotNamespace", "ros.namespace");
  rename(elements, "frameName", "frame_id");
  if (const auto element = elements.take("ros.namespace")) {
    settings.ros_namespace = element->values.front();
    if (!settings.ros_namespace.empty() &&
        (!is_ros_name(settings.ros_namespace) || settings.ros_namespace.front() == '~')) {
      throw elements.error(*element, fmt::format("'{}' is no namespace of ROS", settings.ros_namespace),
                           kRosNameCure);
    }
  }
  const auto remap = [&](const Element& element, std::string_view from, std::string_view to) {
    for (const std::string_view name : {from, to}) {
      if (!is_ros_name(name))
        throw elements.error(element, fmt::format("'{}' is no name of ROS", name), kRosNameCure);
    }
    for (const auto& other : settings.remappings) {
      if (other.first == from) {
        throw elements.error(element, fmt::format("'{}' has a name already, '{}'", from, other.second),
                             "keep one");
      }
    }
    settings.remappings.emplace_back(from, to);
  };
  if (const auto element = elements.take("ros.remapping")) {
    for (const std::string& text : element->values) {
      const std::size_t at = text.find(":=");
      if (at == std::string::npos) {
        throw elements.error(*element, fmt::format("'{}' is no remapping", text),
                             "write FROM:=TO, as in ~/out:=scan");
      }
      remap(*element, trim(std::string_view(text).substr(0, at)),
            trim(std::string_view(text).substr(at + 2)));
    }
  }
  if (const auto element = elements.take("topicName")) {
    remap(*element, "~/out", element->values.front());
    settings.publish_scan = true;
  }
  if (const auto element = elements.take("output_type")) {
    if (element->values.front() != "sensor_msgs/LaserScan") {
      throw elements.error(*element, fmt::format("'{}' is not published", element->values.front()),
                           "write sensor_msgs/LaserScan, or remove it where no scan is wanted");
    }
    settings.publish_scan = true;
  }
  set(settings.frame_id, elements.word("frame_id"));
}

void read_origin(PluginElements& elements, PluginSettings& settings) {
  const std::optional<Element> given[] = {elements.take("origin_latitude"), elements.take("origin_longitude"),
                                          elements.take("origin_altitude")};
  for (const auto& element : given) {
    if (!element) continue;
    // Without a height of its own an origin lies on the ellipsoid; half a place is none.
    if (!given[0] || !given[1]) {
      throw elements.error(*element, "stands without latitude or longitude",
                           "give <origin_latitude> and <origin_longitude>, or none of them");
    }
    elements.put(*element);
  }
  if (!given[0]) return;
  const double latitude_deg = *elements.number("origin_latitude", -90, 90);
  const double longitude_deg = *elements.number("origin_longitude", -180, 180);
  settings.origin = geodesy::Geodetic::from_degrees(
      latitude_deg, longitude_deg, elements.number("origin_altitude", -10e3, 100e3).value_or(0));
}

// Names of files as the scenario's reader takes them: absolute.
void find_files(PluginElements& elements, const PluginPlace& place, const std::string& sdf_file) {
  std::vector<std::filesystem::path> folders;
  if (!place.folder.empty()) folders.push_back(place.folder);
  // A model may bring its files along. What was not read from a file has no path, or a name in its place.
  const std::filesystem::path own(sdf_file);
  if (own.is_absolute()) folders.push_back(own.parent_path());
  for (const std::string_view path : {"sky.navigation", "sky.sp3", "profile"}) {
    auto element = elements.take(path);
    if (!element) continue;
    if (path == "profile" && !simulation::is_profile_path(element->values.front())) {
      elements.put(*std::move(element));
      continue;
    }
    for (std::string& value : element->values) {
      std::vector<std::filesystem::path> looked;
      const auto file = find_resource(value, folders, place.resources, looked);
      if (!file) {
        std::string places;
        for (const auto& candidate : looked) places += (places.empty() ? "" : ", ") + candidate.string();
        throw elements.error(*element,
                             fmt::format("there is no file '{}'; looked for {}", value,
                                         places.empty() ? "it nowhere" : places),
                             "give a path from the folder of the file that the plugin stands in, an absolute "
                             "one, or add its folder to GAZEBO_RESOURCE_PATH "
                             "(model://: GAZEBO_MODEL_PATH, package://: ROS_PACKAGE_PATH)");
      }
      value = file->string();
    }
    elements.put(*std::move(element));
  }
}

void read_outputs(PluginElements& elements, PluginSettings& settings) {
  set(settings.pose_topic, elements.word("pose_topic"));
  set(settings.pose_timeout_s, elements.number("pose_timeout_s", 1e-3, 1e6));
  set(settings.publish_gazebo, elements.boolean("publishers.gazebo"));
  set(settings.publish_ros, elements.boolean("publishers.ros"));
  set(settings.publish_px4, elements.boolean("publishers.px4"));
  set(settings.nmea_port, elements.integer("publishers.nmea_port", 0, 65535));
  if (const auto element = elements.take("publishers.stream")) {
    settings.streams = element->values;
    try {
      for (const std::string& text : settings.streams) {
        (void)output::format_named(output::parse_stream(text).format);
      }
    } catch (const InputError& e) {
      throw elements.error(*element, e.problem(), e.cure());
    }
  }
  set(settings.px4_topic, elements.word("topic"));
  set(settings.show_rays, elements.boolean("visuals.rays"));
  set(settings.show_bubble, elements.boolean("visuals.bubble"));
  set(settings.bubble_scale, elements.number("visuals.bubble_scale", 1e-3, 1e3));
  set(settings.ray_length_m, elements.number("visuals.ray_length_m", 0.1, 1e5));
}

}  // namespace

PluginSettings read_plugin_settings(const sdf::ElementPtr& element, const PluginPlace& place) {
  PluginElements elements(element, place.name, known_paths());
  PluginSettings settings;
  settings.warnings = elements.warnings();
  settings.publish_px4 = read_foreign(elements, settings.warnings);
  const bool paper = read_papers_names(elements);
  read_ros(elements, settings);
  read_origin(elements, settings);
  read_outputs(elements, settings);
  (void)elements.text("link");  // the model's plugin reads it
  settings.visual_geometry = elements.choice("geometry", {"collision", "visual"}) == "visual";
  set(settings.vehicle_blocks, elements.boolean("vehicle_blocks"));
  const std::optional<std::string> engine = elements.choice("ray_engine", {"physics", "embree"});
  find_files(elements, place, element ? element->FilePath() : "");
  settings.named = elements.has("name");
  settings.live = elements.take_live_config();

  const bool mirror = settings.live.receiver.propagation.model == propagation::Model::Mirror;
  if (engine == "physics" && !mirror) {
    throw elements.error({{}, "<ray_engine>", {}}, "the physics engine has no facets for the specular model",
                         "add <propagation><model>mirror</model></propagation>, or write "
                         "<ray_engine>embree</ray_engine>");
  }
  const bool physics = engine ? engine == "physics" : place.on_ray_sensor && paper && mirror;
  settings.ray_engine = physics ? RayEngine::Physics : RayEngine::Embree;
  return settings;
}

}  // namespace canyon::adapters
