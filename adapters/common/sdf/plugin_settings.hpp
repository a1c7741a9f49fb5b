#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <sdf/sdf.hh>
#include <string>
#include <vector>

#include "adapters/common/ros_names.hpp"
#include "adapters/common/sdf/resource_files.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/simulation/live_receiver.hpp"

namespace canyon::adapters {

enum class RayEngine : std::uint8_t { Physics, Embree };

/// Everything that a plugin element says: ros/namespace, ros/remapping "from:=to", ros/changes, frame_id (or
/// frameName), output_type sensor_msgs/LaserScan as RosSettings, and what follows. docs/gazebo.md has the
/// table.
struct PluginSettings : RosSettings {
  /// Keys of the scenario: sky, start, rate_hz, seed, and those of a receiver. The paper's satNum,
  /// satAzimuth, satElevation become sky.frozen, disableNoise becomes noise.enabled.
  simulation::LiveConfig live;
  bool named = false;  ///< `name` stands; where not, live.receiver.options.name is not the user's

  /// origin_latitude [deg], origin_longitude [deg], origin_altitude [m]; empty: the world's
  /// spherical_coordinates.
  std::optional<geodesy::Geodetic> origin;

  RayEngine ray_engine = RayEngine::Embree;  ///< ray_engine: physics or embree
  bool visual_geometry = false;              ///< geometry: collision or visual
  bool vehicle_blocks = false;               ///< vehicle_blocks: rays meet the receiver's own model
  std::string link;                          ///< link; the plugin of a model reads it for itself
  bool serve_all = false;                    ///< serve: marked or all

  std::string pose_topic;       ///< pose_topic: truth from outside instead of Gazebo's
  double pose_timeout_s = 0.5;  ///< pose_timeout_s, of simulated time; > 0

  bool publish_gazebo = true;  ///< publishers/gazebo
  bool publish_ros = true;     ///< publishers/ros
  bool publish_px4 = false;    ///< publishers/px4; on where elements of PX4's own gps plugin stand
  std::string px4_topic;       ///< topic; empty: the name of the model right above the link
  int nmea_port = 0;           ///< publishers/nmea_port; 0: none
  /// publishers/stream, each FORMAT=ADDRESS (output::parse_stream()).
  std::vector<std::string> streams;

  bool show_rays = false;     ///< visuals/rays
  bool show_bubble = false;   ///< visuals/bubble
  double bubble_scale = 1;    ///< visuals/bubble_scale: metres of radius for a metre of error
  double ray_length_m = 100;  ///< visuals/ray_length_m, of rays that meet nothing

  /// One line each: unknown elements, with the closest known one, and elements of other plugins that have no
  /// effect, with what to use instead.
  std::vector<std::string> warnings;
};

/// Where a plugin is attached; decides defaults.
struct PluginPlace {
  bool on_ray_sensor = false;
  std::string name;  ///< for messages: "plugin 'gnss' of model 'car'"
  /// Relative paths belong to it; then to the folder of the file that the element was read from (the world's,
  /// or an included model's), then to Gazebo's resource paths. May be empty.
  std::filesystem::path folder;
  ResourcePaths resources = {};
};

/// Reads a plugin element. Defaults are the paper's where its satAzimuth is given: the profile paper, and on
/// a ray sensor the physics engine. Throws InputError, whose text names place.name, the element as it was
/// written
/// ("<noise><enabled>") and the cure, for a wrong value, an element that stands twice, a file that is not
/// there, and ray_engine physics with the specular model. A null element has nothing but defaults.
[[nodiscard]] PluginSettings read_plugin_settings(const sdf::ElementPtr& element, const PluginPlace& place);

/// `own` with those children of `defaults` whose names it does not have; either may be null. A new element.
[[nodiscard]] sdf::ElementPtr with_defaults(const sdf::ElementPtr& own, const sdf::ElementPtr& defaults);

/// Its fields. Throws InputError where the physics engine is asked for with the specular model.
void visit(options::Visitor& v, PluginSettings& settings);
/// One row per element for docs and tests, the fields first, then their other names.
[[nodiscard]] const std::vector<options::Key>& plugin_keys();

}  // namespace canyon::adapters
