#include "adapters/common/host_settings.hpp"

#include <fmt/format.h>

#include <chrono>
#include <map>
#include <mutex>
#include <string_view>
#include <utility>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/text.hpp"

namespace canyon::adapters {
namespace {

using options::Visitor;

constexpr const char* kRosNameHint =
    "ROS names have letters, digits, '_' and '/', and begin with a letter, '/' or '~'";

void add_remapping(const Visitor& v, std::string_view key, std::string_view from, std::string_view to,
                   HostSettings& settings) {
  for (const std::string_view name : {from, to}) {
    const std::size_t home = name.starts_with("~/") ? 2 : name.starts_with('~') ? 1 : 0;
    if (!is_ros_name(name.substr(home)))
      throw v.fault(key, fmt::format("'{}' is not a valid ROS name", name), kRosNameHint);
  }
  for (const auto& other : settings.remappings) {
    if (other.first != from) continue;
    throw v.fault(key, fmt::format("'{}' is already mapped to '{}'", from, other.second), "keep one");
  }
  settings.remappings.emplace_back(from, to);
}

void visit_ros(Visitor& v, HostSettings& settings) {
  static constexpr std::string_view kScans[]{"sensor_msgs/LaserScan"};
  std::string scan;
  std::string scan_topic;
  v.word({"output_type", "", "publish the rays' ranges: direct and mirror ray of each satellite, alternating",
          "no scan"},
         scan, kScans);
  v.section("ros", [&] {
    std::string& space = settings.ros_namespace;
    v.text({"namespace", "", "of all ROS topics", "the model's name"}, space);
    if (v.has("namespace") && space != "/" &&
        !is_ros_name(std::string_view(space).substr(0, space.size() - (space.back() == '/' ? 1 : 0)))) {
      throw v.fault("namespace", fmt::format("'{}' is not a valid ROS namespace", space), kRosNameHint);
    }
    std::vector<std::string> remappings;
    v.texts({"remapping", "", "FROM:=TO, one element each; '~/out' is the scan"}, remappings);
    for (const std::string& text : remappings) {
      const std::size_t at = text.find(":=");
      if (at == std::string::npos) {
        throw v.fault("remapping", fmt::format("'{}' is not a remapping", text),
                      "write FROM:=TO, as in ~/out:=scan");
      }
      add_remapping(v, "remapping", trim(std::string_view(text).substr(0, at)),
                    trim(std::string_view(text).substr(at + 2)), settings);
    }
    v.boolean({"changes", "", "the ROS services ~/add_fault and ~/end_fault may change the simulation"},
              settings.changes);
  });
  v.text({"topicName", "", "publishes the scan on this ROS topic"}, scan_topic);
  if (!scan_topic.empty()) add_remapping(v, "topicName", "~/out", scan_topic, settings);
  if (v.reads()) settings.publish_scan = !scan.empty() || !scan_topic.empty();
}

void visit_origin(Visitor& v, std::optional<geodesy::Geodetic>& origin) {
  constexpr std::string_view kWorlds = "the world's spherical_coordinates";
  std::optional<double> latitude_deg;
  std::optional<double> longitude_deg;
  double height_m = 0;
  // An origin without a height is on the ellipsoid.
  for (const char* key : {"origin_latitude", "origin_longitude", "origin_altitude"}) {
    if (!v.has(key) || (v.has("origin_latitude") && v.has("origin_longitude"))) continue;
    throw v.fault(key, "is given without latitude or longitude",
                  "give origin_latitude and origin_longitude, or none of them");
  }
  v.number({"origin_latitude", "deg", "of the world's origin: geodetic latitude (WGS 84)", kWorlds},
           latitude_deg, {-90, 90});
  v.number({"origin_longitude", "deg", "longitude, east positive", kWorlds}, longitude_deg, {-180, 180});
  v.number({"origin_altitude", "m", "ellipsoidal height", "0 with origin_latitude, else the world's"},
           height_m, {-10e3, 100e3});
  if (latitude_deg) origin = geodesy::Geodetic::from_degrees(*latitude_deg, *longitude_deg, height_m);
}

void visit_outputs(Visitor& v, HostSettings& settings) {
  live::visit_word(
      v,
      {"pose_topic", "",
       "external poses of the antenna, without lever_arm (the sensor's own pose is not added): "
       "geometry_msgs/PoseStamped on ROS, gazebo.msgs.PoseStamped on Gazebo transport, in the world's "
       "frame",
       "Gazebo's own truth"},
      settings.pose_topic);
  v.section("publishers", [&] {
    v.boolean({"gazebo", "", "canyon.msgs.GnssReceiver on Gazebo transport"}, settings.publish_gazebo);
    v.boolean({"navsat", "", "gz.msgs.NavSat on the sensor's topic; Gazebo Sim's system only"},
              settings.publish_navsat);
    v.boolean({"ros", "", "ROS topics, if the plugin is built with ROS"}, settings.publish_ros);
    v.boolean({"px4", "", "sensor_msgs.msgs.SITLGps on Gazebo transport, for PX4's bridge",
               "false; true with elements of PX4's gps plugin"},
              settings.publish_px4);
    v.integer({"nmea_port", "", "TCP port of 127.0.0.1 that serves NMEA 0183; 0: none"}, settings.nmea_port,
              0, 65535);
  });
  live::visit_word(
      v, {"topic", "", "last part of PX4's topic ~/MODEL/link/TOPIC", "the name of the link's parent model"},
      settings.px4_topic);
  v.section("visuals", [&] {
    v.boolean({"rays", "", "a ray to each satellite in the world, coloured by visibility"},
              settings.show_rays);
    v.boolean({"bubble", "", "a translucent sphere around the vehicle that shows the error of its fix"},
              settings.show_bubble);
    v.number({"bubble_scale", "m/m", "metres of its radius per metre of error"}, settings.bubble_scale,
             {1e-3, 1e3});
    v.number({"ray_length_m", "m", "length of rays without a hit"}, settings.ray_length_m, {0.1, 1e5});
  });
}

}  // namespace

void visit(Visitor& v, HostSettings& settings) {
  static constexpr std::string_view kEngines[]{"physics", "embree"};
  static constexpr std::string_view kServed[]{"marked", "all"};
  static constexpr std::string_view kGeometries[]{"collision", "visual"};
  live::visit_host(v, settings, settings.frame_id);
  v.other_name("pose_timeout_s", "pose.timeout_s");
  v.other_name("publishers.stream", "streams");
  visit_ros(v, settings);
  visit_origin(v, settings.origin);
  v.choice(
      {"ray_engine", "",
       "embree: the engine's own rays; physics: those of Gazebo's physics engine, for the mirror model only",
       "embree; physics on a ray sensor with satAzimuth"},
      settings.ray_engine, kEngines);
  v.text({"link", "", "libGNSSMultipathModelPlugin.so only: the link with the antenna", "the model's first"},
         settings.link);
  v.choice({"serve", "",
            "Gazebo Sim's system only: the navsat sensors that have a <canyon> element, or all of them"},
           settings.serve_all, kServed);
  v.choice({"geometry", "", "geometry hit by embree rays"}, settings.visual_geometry, kGeometries);
  v.part("facades", settings.facades);
  v.boolean({"vehicle_blocks", "", "the receiver's own model blocks rays"}, settings.vehicle_blocks);
  visit_outputs(v, settings);
  visit(v, settings.live);
  if (v.reads()) settings.named = v.has("name");
  if (v.has("ray_engine") && settings.ray_engine == RayEngine::Physics &&
      settings.live.receiver().propagation.model != propagation::Model::Mirror) {
    throw v.fault("ray_engine", "the physics engine has no facets for the specular model",
                  "set propagation.model to mirror, or ray_engine to embree");
  }
}

live::WorldFrame world_frame(const std::optional<live::HostOrigin>& host, const HostSettings& settings,
                             std::vector<std::string>& warnings) {
  live::WorldFrame frame;
  if (host) frame.heading_rad = host->heading_rad;
  const geodesy::Geodetic origin = settings.origin ? *settings.origin
                                   : host          ? host->origin
                                                   : geodesy::Geodetic{};
  if (!settings.origin && origin.latitude_rad == 0 && origin.longitude_rad == 0) {
    warnings.emplace_back(
        "the world is at latitude 0, longitude 0; add spherical_coordinates, or to the receiver "
        "origin_latitude, origin_longitude and origin_altitude");
  }
  frame.enu = geodesy::LocalFrame(origin);
  return frame;
}

live::WorldScene::Options scene_options(const std::string& world, const HostSettings& settings,
                                        const live::WorldFrame& frame) {
  return {world, settings.visual_geometry, frame, settings.facades,
          settings.facades.is_sampled() ? settings.live.seed : 1};
}

geodesy::GpsTime start_of_world(const void* world, const std::string& name, std::int64_t sim_time_ns) {
  static std::mutex mutex;
  static std::map<std::string, std::pair<const void*, geodesy::GpsTime>> starts;
  const std::lock_guard lock(mutex);
  auto& [of, start] = starts[name];
  if (of != world) {
    of = world;
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    start = geodesy::gps_from_unix(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count()) -
            std::chrono::nanoseconds(sim_time_ns);
  }
  return start;
}

live::HostSetup setup_of(const HostSettings& settings, const ReceiverIdentity& identity,
                         const live::WorldFrame& frame, geodesy::GpsTime start_of_world,
                         double sensor_rate_hz, live::LogFunction log) {
  live::HostSetup setup;
  setup.options = settings;
  // Receivers with the same seed have independent noise by their names.
  if (!settings.named) {
    setup.options.live.receiver().options.name =
        fmt::format("{}/{}/{}", identity.link, identity.sensor, identity.plugin);
  }
  setup.name = receiver_label(identity);
  setup.frame = frame;
  setup.start = start_of_world;
  if (sensor_rate_hz > 0) setup.rate_hz = sensor_rate_hz;
  setup.scan = settings.publish_scan;
  setup.warnings = settings.warnings;
  setup.log = std::move(log);
  setup.model = identity.model;
  if (settings.nmea_port != 0)
    setup.streams.emplace_back("nmea_port", fmt::format("nmea=tcp://127.0.0.1:{}", settings.nmea_port));
  for (const std::string& stream : settings.streams) setup.streams.emplace_back("streams", stream);
  return setup;
}

live::FaultRequestHandler hosted_faults(std::shared_ptr<live::RequestQueue> desk, const std::string& receiver,
                                        const RosSettings& settings) {
  return {[desk = std::move(desk), receiver](live::OptionsRequest request) {
            request.receiver = receiver;
            return desk->submit(std::move(request));
          },
          settings.changes, "write <ros><changes>true</changes></ros> in its settings"};
}

}  // namespace canyon::adapters
