// The table of every element of a plugin. Defaults come from the structs that the elements fill.
#include <fmt/format.h>

#include <map>

#include "adapters/common/sdf/plugin_settings.hpp"

namespace canyon::adapters {
namespace {

std::string show(bool value) {
  return value ? "true" : "false";
}
std::string show(int value) {
  return fmt::format("{}", value);
}
std::string show(double value) {
  return fmt::format("{:.9g}", value);
}

// Scenario keys of which a plugin has another default or meaning than a file.
struct Difference {
  const char* default_value;
  const char* meaning;
};
const std::map<std::string, Difference>& differences() {
  static const std::map<std::string, Difference> table{
      {"sky.navigation",
       {"",
        "RINEX navigation files, one element each, plain or gzip (one of navigation, sp3, nominal, frozen)"}},
      {"sky.frozen.satNum",
       {nullptr, "the same as satNum, without the paper's defaults for model and engine"}},
      {"sky.systems",
       {nullptr, "GPS, GLONASS, Galileo, BeiDou, QZSS: in one element with blanks between, or repeated"}},
      {"start",
       {"the machine's time when the world's first receiver is loaded",
        "time at simulated time 0: 2019-04-28T12:58:03Z, or with ' GPST' behind it"}},
      {"start.week", {nullptr, "instead: full GPS week, with tow inside start"}},
      {"rate_hz", {"the sensor's update_rate, 10 without one", "epochs per second of simulated time"}},
      {"name", {"by model, link and plugin", "names the receiver and its noise"}},
      {"lever_arm.forward_m",
       {nullptr, "antenna from the sensor's, or the link's, origin: ahead, turned with its attitude"}},
      {"propagation.model", {"specular; mirror with satAzimuth", nullptr}},
  };
  return table;
}

std::vector<simulation::ScenarioKey> make_keys() {
  std::vector<simulation::ScenarioKey> keys;
  const auto add = [&keys](const char* path, const char* unit, std::string value, const char* meaning) {
    keys.push_back({path, unit, std::move(value), meaning});
  };
  const PluginSettings d;

  add("satNum", "satellites", "the lists' length", "the paper's virtual satellites that never move");
  add("satAzimuth", "rad", "",
      "their azimuths from north, clockwise, with blanks between; makes the mirror model, and on a ray "
      "sensor "
      "the physics engine, the default");
  add("satElevation", "rad", "", "their elevations");
  add("disableNoise", "", "", "true: noise.enabled false");
  add("output_type", "", "no scan",
      "sensor_msgs/LaserScan: publish the rays' ranges, direct and mirror ray of each satellite in turn");
  add("ros.namespace", "", "the model's name", "of all ROS topics");
  add("ros.remapping", "", "", "FROM:=TO, one element each; '~/out' is the scan");
  add("frame_id", "", "the link's name", "of all ROS messages");

  add("origin_latitude", "deg", "the world's spherical_coordinates",
      "of the world's origin: geodetic latitude (WGS 84)");
  add("origin_longitude", "deg", "the world's spherical_coordinates", "longitude, east positive");
  add("origin_altitude", "m", "0 with origin_latitude, else the world's", "ellipsoidal height");

  add("ray_engine", "", "embree; physics on a ray sensor with satAzimuth",
      "embree: the engine's own rays; physics: those of Gazebo's physics engine, for the mirror model only");
  add("link", "", "the model's first",
      "libGNSSMultipathModelPlugin.so only: the link that carries the antenna");
  add("geometry", "", "collision", "collision or visual: what embree rays meet");
  add("vehicle_blocks", "", show(d.vehicle_blocks), "rays meet the receiver's own model");

  add("pose_topic", "", "Gazebo's own truth",
      "poses of the antenna, less lever_arm, from outside (the sensor's own pose is not added): "
      "geometry_msgs/PoseStamped on ROS, gazebo.msgs.PoseStamped on Gazebo transport, in the world's frame");
  add("pose_timeout_s", "s", show(d.pose_timeout_s),
      "of simulated time since the last pose came; without truth there is no epoch");

  add("publishers.gazebo", "", show(d.publish_gazebo), "canyon.msgs.GnssReceiver on Gazebo transport");
  add("publishers.ros", "", show(d.publish_ros), "ROS topics, where the plugin is built with ROS");
  add("publishers.px4", "", "false; true beside elements of PX4's gps plugin",
      "sensor_msgs.msgs.SITLGps on Gazebo transport, for PX4's bridge");
  add("publishers.nmea_port", "", show(d.nmea_port), "TCP port of 127.0.0.1 that serves NMEA 0183; 0: none");
  add("publishers.stream", "", "",
      "FORMAT=ADDRESS, one element each, as of canyon simulate --stream: nmea=tcp://127.0.0.1:2947");
  add("topic", "", "the name of the model right above the link",
      "last part of PX4's topic ~/MODEL/link/TOPIC");

  add("visuals.rays", "", show(d.show_rays), "a ray to each satellite in the world, coloured by visibility");
  add("visuals.bubble", "", show(d.show_bubble),
      "a translucent sphere about the vehicle that shows the error of its fix");
  add("visuals.bubble_scale", "m/m", show(d.bubble_scale), "metres of its radius for a metre of error");
  add("visuals.ray_length_m", "m", show(d.ray_length_m), "length of rays that meet nothing");

  for (simulation::ScenarioKey key : simulation::live_keys()) {
    const auto at = differences().find(key.path);
    if (at != differences().end()) {
      if (at->second.default_value != nullptr) key.default_value = at->second.default_value;
      if (at->second.meaning != nullptr) key.meaning = at->second.meaning;
    }
    keys.push_back(std::move(key));
  }

  add("frameName", "", "", "the same as frame_id");
  add("topicName", "", "", "publishes the scan on this ROS topic");
  add("robotNamespace", "", "", "the same as ros.namespace");
  add("gpsNoise", "", "", "the same as noise.enabled");
  add("update_rate", "Hz", "", "the same as rate_hz");
  return keys;
}

}  // namespace

const std::vector<simulation::ScenarioKey>& plugin_keys() {
  static const std::vector<simulation::ScenarioKey> keys = make_keys();
  return keys;
}

}  // namespace canyon::adapters
