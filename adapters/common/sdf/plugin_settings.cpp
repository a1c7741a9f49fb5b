#include "adapters/common/sdf/plugin_settings.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "adapters/common/sdf/plugin_elements.hpp"
#include "canyon/base/input_files.hpp"
#include "canyon/base/text.hpp"

namespace canyon::adapters {
namespace {

using options::Key;

// Other names of keys: the paper's, the older prototype's, and those of PX4's gps plugin.
struct OtherName {
  const char* name;
  const char* path;
  const char* effect = "";  // additional
};
constexpr OtherName kOtherNames[] = {
    {"satNum", "sky.frozen.satNum"},
    {"satAzimuth", "sky.frozen.satAzimuth",
     ", separated by blanks; the default becomes profile paper and, on a ray sensor, the physics engine"},
    {"satElevation", "sky.frozen.satElevation", ", separated by blanks"},
    {"disableNoise", "noise.enabled", ", inverted"},
    {"frameName", "frame_id"},
    {"robotNamespace", "ros.namespace"},
    {"gpsNoise", "noise.enabled"},
    {"update_rate", "rate_hz"},
};

// Elements of other plugins that are replaced by this one, and their replacements.
struct Foreign {
  const char* name;
  const char* hint;
};
constexpr const char* kPx4Noise =
    "<noise><sigma_m_per_sqrt_s> and <noise><theta_per_s> set the noise of pseudoranges here, "
    "<noise><doppler_sigma_hz> the noise of velocity";
constexpr const char* kPx4Home =
    "the world's spherical_coordinates, or <origin_latitude>, <origin_longitude> and <origin_altitude>, "
    "define "
    "the origin here";
constexpr Foreign kPx4[] = {
    {"gpsXYRandomWalk", kPx4Noise},  {"gpsZRandomWalk", kPx4Noise},     {"gpsXYNoiseDensity", kPx4Noise},
    {"gpsZNoiseDensity", kPx4Noise}, {"gpsVXYNoiseDensity", kPx4Noise}, {"gpsVZNoiseDensity", kPx4Noise},
    {"homeLatitude", kPx4Home},      {"homeLongitude", kPx4Home},       {"homeAltitude", kPx4Home},
};
constexpr Foreign kPrototypes[] = {
    {"offsetTopicName", "the offsets are in range_offset of the ROS topic gnss_multipath"},
    {"satRayTopicName", "<visuals><rays>true</rays></visuals> shows the rays"},
    {"errorScale", "errors are in metres, unscaled; <visuals><bubble_scale> scales their display"},
};

// Keys whose default or meaning in a plugin differs from that in a file.
struct Difference {
  const char* path;
  const char* default_value;
  const char* meaning = nullptr;
};
constexpr Difference kDifferences[] = {
    {"start", "the machine's time when the world's first receiver is loaded",
     "time at simulated time 0: 2019-04-28T12:58:03Z, or with ' GPST' appended"},
    {"rate_hz", "the sensor's update_rate, 10 without one", "epochs per second of simulated time"},
    {"name", "by model, link and plugin", "names the receiver and its noise"},
    {"lever_arm.forward_m", "0",
     "antenna from the sensor's, or the link's, origin: ahead, rotated with its attitude"},
    {"profile", "ublox-m10; paper with satAzimuth"},
};

options::Description make_description() {
  options::Description description = options::describe<HostSettings>();
  for (const Difference& difference : kDifferences) {
    const auto key = std::find_if(description.keys.begin(), description.keys.end(),
                                  [&](const Key& each) { return each.path == difference.path; });
    key->default_value = difference.default_value;
    if (difference.meaning != nullptr) key->meaning = difference.meaning;
  }
  for (const OtherName& other : kOtherNames) description.add_other_name(other.name, other.path, other.effect);
  for (const Foreign& foreign : kPx4) description.replaced.emplace(foreign.name, foreign.hint);
  for (const Foreign& foreign : kPrototypes) description.replaced.emplace(foreign.name, foreign.hint);
  return description;
}

const options::Description& plugin_description() {
  static const options::Description description = make_description();
  return description;
}

// The reader rejects other texts.
std::string flipped_axes(const std::string& text) {
  const std::string small = lower_case(text);
  if (small == "true" || small == "1") return "false";
  return small == "false" || small == "0" ? "true" : text;
}

sdf::ElementPtr child_of(const sdf::ElementPtr& element, const char* name) {
  return element && element->HasElement(name) ? element->GetElement(name) : nullptr;
}

/// The sensor's own <noise> for a receiver without a profile.
void put_noise(const sdf::ElementPtr& sensor, PluginElements& elements, std::vector<std::string>& warnings) {
  sdf::ElementPtr own = child_of(sensor, "navsat");
  if (!own) own = child_of(sensor, "gps");
  bool any = false, more = false;
  for (const auto& [sensing, unit] : {std::pair("position_sensing", "m"), {"velocity_sensing", "mps"}}) {
    for (const char* axis : {"horizontal", "vertical"}) {
      const sdf::ElementPtr noise = child_of(child_of(child_of(own, sensing), axis), "noise");
      const sdf::ElementPtr deviation = child_of(noise, "stddev");
      if (!deviation || noise->Get<std::string>("type") == "none") continue;
      any = true;
      for (const char* name : {"mean", "bias_mean", "bias_stddev", "precision"})
        more = more || (noise->HasElement(name) && noise->Get<double>(name) != 0);
      elements.put_default(fmt::format("fix_noise.{}_{}", axis, unit),
                           options::show(deviation->Get<double>()), "<noise>");
    }
  }
  if (!any) return;
  for (const char* path : {"ionosphere", "troposphere", "orbit_errors", "signal.loop_noise"})
    elements.put_default(path, "false", "<noise>");
  if (!elements.has("gpsNoise") && !elements.has("disableNoise"))
    elements.put_default("noise.enabled", "false", "<noise>");
  if (more) warnings.emplace_back("only <stddev> of the sensor's own <noise> is used: errors have no mean");
}

}  // namespace

void check_sensor(const sdf::ElementPtr& sensor, const std::string& name) {
  if (!sensor->HasElement("canyon")) return;
  const sdf::ElementPtr own = sensor->GetElement("canyon");
  if (own->GetNextElement("canyon"))
    throw InputError(name + ": <canyon> is given twice in <sensor>", "merge the two");
  if (own->HasElement("serve"))
    throw InputError(name + ": <serve> is inside <canyon>", "move it to the system's <plugin>");
}

std::string frame_of(const sdf::ElementPtr& sensor, const std::string& otherwise) {
  for (const char* name : {"gz_frame_id", "ignition_frame_id"})
    if (sensor->HasElement(name)) return sensor->Get<std::string>(name);
  return otherwise;
}

sdf::ElementPtr with_defaults(const sdf::ElementPtr& own, const sdf::ElementPtr& defaults) {
  sdf::ElementPtr both = own ? own->Clone() : std::make_shared<sdf::Element>();
  if (!own && defaults) both->SetFilePath(defaults->FilePath());
  for (sdf::ElementPtr child = defaults ? defaults->GetFirstElement() : nullptr; child;
       child = child->GetNextElement()) {
    if (own && own->HasElement(child->GetName())) continue;
    const sdf::ElementPtr copy = child->Clone();
    copy->SetParent(both);
    both->InsertElement(copy);
  }
  return both;
}

const std::vector<Key>& plugin_keys() {
  return plugin_description().keys;
}

HostSettings read_plugin_settings(const sdf::ElementPtr& element, const PluginContext& context) {
  InputFiles::begin_run();
  PluginElements elements(element, context.name, plugin_description());
  HostSettings settings;
  settings.warnings = elements.warnings();
  settings.publish_px4 =
      elements.has("gpsNoise") || std::any_of(std::begin(kPx4), std::end(kPx4), [&](const Foreign& foreign) {
        return elements.has_replaced(foreign.name);
      });
  settings.live.allow_external_base = true;       // live::HostBases
  const bool paper = elements.has("satAzimuth");  // the paper's satellites imply its receiver
  if (paper && !elements.has("profile")) elements.put("profile", "paper", "<satAzimuth>");
  if (const auto disabled = elements.take("disableNoise"))
    elements.put("disableNoise", flipped_axes(*disabled), "<disableNoise>");
  if (!elements.has("profile")) put_noise(context.sensor, elements, settings.warnings);
  std::vector<std::filesystem::path> folders;
  if (!context.folder.empty()) folders.push_back(context.folder);
  // A model may include its files. Elements that are not from a file have no absolute path.
  const std::filesystem::path own(element ? element->FilePath() : "");
  if (own.is_absolute()) {
    folders.push_back(own.parent_path());
    InputFiles::current().add(own);
  }
  elements.read(settings, folders, context.resources);
  const bool mirror = settings.live.receiver().propagation.model == propagation::Model::Mirror;
  if (context.on_ray_sensor && paper && mirror && !elements.has("ray_engine"))
    settings.ray_engine = RayEngine::Physics;
  return settings;
}

}  // namespace canyon::adapters
