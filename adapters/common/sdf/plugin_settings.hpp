#pragma once

#include <filesystem>
#include <sdf/sdf.hh>
#include <string>
#include <vector>

#include "adapters/common/host_settings.hpp"
#include "adapters/common/resource_files.hpp"
#include "canyon/base/options/describe.hpp"

namespace canyon::adapters {

/// The context of a plugin, which determines defaults.
struct PluginContext {
  bool on_ray_sensor = false;
  std::string name;  ///< for messages: "plugin 'gnss' of model 'car'"
  /// Folder of relative paths; searched next are the folder of the element's file (the world's or an included
  /// model's) and Gazebo's resource paths. May be empty.
  std::filesystem::path folder;
  ResourcePaths resources = {};
  /// The <sensor> of type navsat or gps with the plugin; null: another type, or none.
  sdf::ElementPtr sensor = {};
};

/// Reads a plugin element. The paper's satNum, satAzimuth, satElevation become sky.frozen, disableNoise
/// becomes noise.enabled, frameName frame_id. Warnings name unknown elements, with the closest known one, and
/// elements of other plugins. Defaults are the paper's if its satAzimuth is given: the profile paper, and on
/// a ray sensor the physics engine. Without a profile, the standard deviations of the sensor's own <noise>
/// [m], [m/s] become fix_noise, and the receiver's other errors in open sky are off unless elements set them;
/// effects of buildings stay those of the default profile. Throws InputError, whose text names place.name,
/// the element as it was written ("<noise><enabled>") and the hint, for a wrong value, a repeated element, a
/// missing file, and ray_engine physics with the specular model. A null element has only defaults.
[[nodiscard]] HostSettings read_plugin_settings(const sdf::ElementPtr& element, const PluginContext& context);

/// Throws InputError, whose text begins with `name`, for a <sensor> with two <canyon> elements, and for
/// <serve> in one, which belongs to the plugin.
void check_sensor(const sdf::ElementPtr& sensor, const std::string& name);
/// The <gz_frame_id> of a <sensor>, or ignition_frame_id; `otherwise` if it has neither.
[[nodiscard]] std::string frame_of(const sdf::ElementPtr& sensor, const std::string& otherwise);

/// A new element: `own` plus the children of `defaults` with names missing in `own`; either may be null.
[[nodiscard]] sdf::ElementPtr with_defaults(const sdf::ElementPtr& own, const sdf::ElementPtr& defaults);

/// One row per element for docs and tests, the fields first, then their other names.
[[nodiscard]] const std::vector<options::Key>& plugin_keys();

}  // namespace canyon::adapters
