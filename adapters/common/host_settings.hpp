#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "adapters/common/ray_visuals.hpp"
#include "adapters/common/ros_names.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/facades.hpp"
#include "canyon/outputs/live/hosted_receiver.hpp"

namespace canyon::adapters {

enum class RayEngine : std::uint8_t { Physics, Embree };

/// The settings of one receiver in a simulator's world: those of all hosts and those of simulators:
/// ros/namespace, ros/remapping "from:=to", ros/changes, output_type sensor_msgs/LaserScan as RosSettings,
/// visuals/rays, bubble, bubble_scale, ray_length_m as VisualSettings, and the fields
/// below. docs/sdf.md has the table.
struct HostSettings : live::HostOptions, RosSettings, VisualSettings {
  /// origin_latitude, origin_longitude [deg], origin_altitude [m]; empty: the world's spherical_coordinates.
  std::optional<geodesy::Geodetic> origin;

  RayEngine ray_engine = RayEngine::Embree;  ///< ray_engine: physics or embree
  bool visual_geometry = false;              ///< geometry: collision or visual
  city::FacadeOptions facades;               ///< facades, as a scenario's city.facades
  bool vehicle_blocks = false;               ///< vehicle_blocks: the receiver's own model blocks rays
  std::string link;                          ///< link; a model's plugin reads it itself
  bool serve_all = false;                    ///< serve: marked or all

  std::string pose_topic;  ///< pose_topic: external truth instead of the host's

  bool publish_gazebo = true;  ///< publishers/gazebo
  bool publish_navsat = true;  ///< publishers/navsat
  bool publish_ros = true;     ///< publishers/ros
  bool publish_px4 = false;    ///< publishers/px4; on if there are elements of PX4's own gps plugin
  std::string px4_topic;       ///< topic; empty: the name of the link's parent model
  int nmea_port = 0;           ///< publishers/nmea_port; 0: none

  /// The reader's warnings, one line each: settings without effect and their replacements.
  std::vector<std::string> warnings;
};

/// For options::read(). Throws InputError if the physics engine is requested with the specular model.
void visit(options::Visitor& v, HostSettings& settings);

/// `settings.origin`, else the host's; without any latitude 0, longitude 0 and a line in `warnings`.
[[nodiscard]] live::WorldFrame world_frame(const std::optional<live::HostOrigin>& host,
                                           const HostSettings& settings, std::vector<std::string>& warnings);

/// The scene of the world with this name for a receiver with these settings.
[[nodiscard]] live::WorldScene::Options scene_options(const std::string& world, const HostSettings& settings,
                                                      const live::WorldFrame& frame);

/// GPS time of a world's time 0 if not configured: the machine's time when the first receiver was loaded, the
/// same for all receivers. `world`: any address that identifies the world; `sim_time_ns`: its present time.
[[nodiscard]] geodesy::GpsTime start_of_world(const void* world, const std::string& name,
                                              std::int64_t sim_time_ns);

/// A simulator's receiver, named by receiver_label(). @param sensor_rate_hz of its sensor; 0: none
[[nodiscard]] live::HostSetup setup_of(const HostSettings& settings, const ReceiverIdentity& identity,
                                       const live::WorldFrame& frame, geodesy::GpsTime start_of_world,
                                       double sensor_rate_hz, live::LogFunction log);

/// Handles ROS services of a host's receiver, registered in `desk` by this name, if settings allow changes.
[[nodiscard]] live::FaultRequestHandler hosted_faults(std::shared_ptr<live::RequestQueue> desk,
                                                      const std::string& receiver,
                                                      const RosSettings& settings);

}  // namespace canyon::adapters
