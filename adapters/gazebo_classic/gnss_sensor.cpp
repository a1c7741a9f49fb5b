#include "adapters/gazebo_classic/gnss_sensor.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <cmath>
#include <gazebo/common/Console.hh>
#include <gazebo/common/Events.hh>
#include <gazebo/common/SphericalCoordinates.hh>
#include <gazebo/physics/physics.hh>
#include <gazebo/sensors/RaySensor.hh>
#include <gazebo/sensors/Sensor.hh>
#include <gazebo/transport/Node.hh>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "adapters/common/epoch_publisher.hpp"
#include "adapters/common/sdf/plugin_settings.hpp"
#include "adapters/common/stream_publisher.hpp"
#include "adapters/common/update_schedule.hpp"
#include "adapters/gazebo_classic/ignition_types.hpp"
#include "adapters/gazebo_classic/physics_rays.hpp"
#include "adapters/gazebo_classic/pose_source.hpp"
#include "adapters/gazebo_classic/publishers.hpp"
#include "adapters/gazebo_classic/resource_paths.hpp"
#include "adapters/gazebo_classic/world_geometry.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/simulation/city_scene.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using Eigen::Vector3d;
using geodesy::GpsTime;

constexpr double kDefaultRate_hz = 10;
// Rays of a physics engine have an end. A roof that hides a satellite 10 deg high from here is 870 m high.
constexpr double kPhysicsReach_m = 5000;

ReceiverIdentity identify(const Attachment& at) {
  ReceiverIdentity identity;
  identity.world = at.world->Name();
  const gazebo::physics::ModelPtr parent = at.link->GetModel();
  identity.parent = parent->GetName();
  identity.model = at.link->GetParentModel()->GetName();
  identity.link = at.link->GetScopedName();
  if (at.sensor) identity.sensor = at.sensor->Name();
  identity.plugin = at.sdf->Get<std::string>("name");
  return identity;
}

std::string place_name(const ReceiverIdentity& identity) {
  std::string name = fmt::format("plugin '{}' of model '{}'", identity.plugin, identity.model);
  if (!identity.sensor.empty()) name += fmt::format(", sensor '{}'", identity.sensor);
  return name;
}

// GPS time of the world's time 0 where nobody says it: when its first receiver was loaded, the same for all.
GpsTime start_of(const gazebo::physics::World* world, const gazebo::common::Time& sim_time) {
  static std::mutex mutex;
  static std::map<std::string, std::pair<const gazebo::physics::World*, GpsTime>> starts;
  const std::lock_guard lock(mutex);
  auto& [of, start] = starts[world->Name()];
  if (of != world) {
    of = world;
    start = geodesy::gps_from_unix(nanoseconds(gazebo::common::Time::GetWallTime())) -
            std::chrono::nanoseconds(nanoseconds(sim_time));
  }
  return start;
}

WorldFrame world_frame(const gazebo::physics::World& world, const PluginSettings& settings,
                       std::vector<std::string>& warnings) {
  WorldFrame frame;
  const gazebo::common::SphericalCoordinatesPtr coordinates = world.SphericalCoords();
  if (coordinates) frame.heading_rad = coordinates->HeadingOffset().Radian();
  geodesy::Geodetic origin;
  if (settings.origin) {
    origin = *settings.origin;
  } else if (coordinates) {
    origin = {coordinates->LatitudeReference().Radian(), coordinates->LongitudeReference().Radian(),
              coordinates->GetElevationReference()};
    if (origin.latitude_rad == 0 && origin.longitude_rad == 0) {
      warnings.emplace_back(
          "the world lies at latitude 0, longitude 0; give it <spherical_coordinates>, or the plugin "
          "<origin_latitude>, <origin_longitude> and <origin_altitude>");
    }
  }
  frame.enu = geodesy::LocalFrame(origin);
  return frame;
}

std::shared_ptr<simulation::CityScene> open_field(const WorldFrame& frame) {
  city::City city;
  city.name = "open field";
  city.frame = frame.enu;
  return std::make_shared<simulation::CityScene>(std::move(city));
}

}  // namespace

struct GnssSensor::Impl {
  explicit Impl(const Attachment& attachment);
  ~Impl();

  void update();
  void observe(const gazebo::common::Time& now, const TruePose& truth, ReceiverReport& report);
  void bring_scene_up_to_date();
  void trace_by_physics(const Vector3d& antenna_enu, std::span<const Vector3d> directions,
                        std::span<propagation::SatellitePaths> result);
  [[nodiscard]] std::vector<double> scan_by_embree(const Vector3d& antenna_enu) const;
  [[nodiscard]] output::ReceiverDescription description() const;
  void reset();
  /// Says a thing once.
  void warn(const std::string& message);
  void fail(const std::string& message);

  Attachment at;
  ReceiverIdentity identity;
  std::string name;
  PluginSettings settings;
  WorldFrame frame;
  Eigen::Matrix3d enu_from_world = Eigen::Matrix3d::Identity();
  UpdateSchedule schedule{kDefaultRate_hz};
  gazebo::transport::NodePtr node;
  std::unique_ptr<PoseSource> pose_source;
  std::shared_ptr<WorldGeometry> geometry;
  std::uint64_t generation = 0;
  bool has_scene = false;
  std::unique_ptr<PhysicsRays> physics;
  std::optional<simulation::LiveReceiver> receiver;
  std::optional<simulation::LiveReceiver::Step> step;
  std::vector<std::unique_ptr<EpochPublisher>> publishers;
  std::vector<PhysicsRay> rays;  // of the physics engine, and what they met
  std::vector<double> ranges;
  gazebo::physics::ModelPtr left_out;
  gazebo::common::Time last;
  std::set<std::string> said;
  gazebo::event::ConnectionPtr connection;
};

GnssSensor::Impl::Impl(const Attachment& attachment)
    : at(attachment), identity(identify(attachment)), name(place_name(identity)) {
  const auto ray_sensor = std::dynamic_pointer_cast<gazebo::sensors::RaySensor>(at.sensor);
  PluginPlace place;
  place.on_ray_sensor = ray_sensor != nullptr;
  place.name = name;
  place.folder = std::filesystem::path(at.sdf->FilePath()).parent_path();
  place.resources = gazebos_paths();
  settings = read_plugin_settings(at.sdf, place);
  std::vector<std::string> warnings = std::exchange(settings.warnings, {});
  // Receivers of one seed have noise of their own by their names.
  if (!settings.named) {
    settings.live.receiver.options.name =
        fmt::format("{}/{}/{}", identity.link, identity.sensor, identity.plugin);
  }

  frame = world_frame(*at.world, settings, warnings);
  enu_from_world = frame.enu_from_world();
  const double sensor_rate_hz = at.sensor ? at.sensor->UpdateRate() : 0;
  schedule =
      UpdateSchedule(settings.live.rate_hz.value_or(sensor_rate_hz > 0 ? sensor_rate_hz : kDefaultRate_hz));
  const GpsTime start = settings.live.start.value_or(start_of(at.world.get(), at.world->SimTime()));
  receiver.emplace(settings.live, open_field(frame), start);
  for (const std::string& line : receiver->take_warnings()) warnings.push_back(line);

  if (!settings.vehicle_blocks) left_out = at.link->GetParentModel();
  if (settings.ray_engine == RayEngine::Physics) {
    physics = std::make_unique<PhysicsRays>(at.link, ray_sensor, identity.plugin);
    receiver->set_tracer([this](const Vector3d& antenna, std::span<const Vector3d> directions,
                                std::span<propagation::SatellitePaths> result) {
      trace_by_physics(antenna, directions, result);
    });
  } else {
    geometry = WorldGeometry::of(at.world, {settings.visual_geometry, frame});
  }

  node = gazebo::transport::NodePtr(new gazebo::transport::Node());
  node->Init(at.world->Name());
  pose_source =
      settings.pose_topic.empty()
          ? make_link_pose_source(at.link, at.sensor ? at.sensor->Pose() : ignition::math::Pose3d::Zero)
          : make_topic_pose_source(node, settings);
  if (settings.publish_gazebo) publishers.push_back(make_gazebo_publisher(node, identity));
  if (settings.publish_px4) publishers.push_back(make_px4_publisher(node, identity, settings));
  if (settings.nmea_port != 0) {
    publishers.push_back(make_stream_publisher(
        "nmea_port", fmt::format("nmea=tcp://127.0.0.1:{}", settings.nmea_port), description()));
  }
  for (const std::string& stream : settings.streams) {
    publishers.push_back(make_stream_publisher("publishers.stream", stream, description()));
  }
  if (settings.show_rays || settings.show_bubble)
    publishers.push_back(make_visuals(node, identity, settings));
  if (settings.publish_ros) {
    try {
      if (auto ros = make_ros_publisher(identity, settings)) publishers.push_back(std::move(ros));
    } catch (const InputError& e) {  // the other ways out are still good
      fail(fmt::format("{}; nothing of this receiver goes to ROS", e.what()));
    }
  }

  for (const std::string& line : warnings) warn(line);
  last = at.world->SimTime();
  connection = gazebo::event::Events::ConnectWorldUpdateEnd([this] { update(); });
}

GnssSensor::Impl::~Impl() {
  connection.reset();
  publishers.clear();
  pose_source.reset();
  node->Fini();  // takes its topics back
}

void GnssSensor::Impl::warn(const std::string& message) {
  if (said.insert(message).second) gzwarn << "[canyon] " << name << ": " << message << "\n";
}

void GnssSensor::Impl::fail(const std::string& message) {
  if (said.insert(message).second) gzerr << "[canyon] " << name << ": " << message << "\n";
}

output::ReceiverDescription GnssSensor::Impl::description() const {
  const simulation::BuiltSky& sky = receiver->sky();
  return output::describe_receiver(settings.live.receiver.options, *sky.sky, sky.navigation,
                                   receiver->start(), schedule.interval_s());
}

void GnssSensor::Impl::reset() {
  receiver->restart();
  pose_source->reset();
  for (const auto& publisher : publishers) publisher->reset();
}

// Callbacks of Gazebo's events must not throw.
void GnssSensor::Impl::update() {
  // The model was removed; a sensor's plugin is some time later.
  if (!at.link->GetParent()) return;
  const gazebo::common::Time now = at.world->SimTime();
  if (now < last) reset();
  last = now;
  if (!schedule.due(nanoseconds(now))) return;

  ReceiverReport report;
  report.sim_time_ns = nanoseconds(now);
  report.world_yaw_from_enu_rad = -frame.heading_rad;
  step.reset();
  try {
    if (const auto truth = pose_source->at(now, report.reason)) observe(now, *truth, report);
  } catch (const std::exception& e) {
    report.reason = e.what();
    fail(report.reason);
  }
  report.step = step ? &*step : nullptr;
  if (step) {
    for (const std::string& line : receiver->take_warnings()) warn(line);
  } else {
    report.scan_ranges_m.clear();
  }
  for (const auto& publisher : publishers) {
    publisher->publish(report);
    for (const std::string& note : publisher->take_notes()) warn(note);
  }
}

void GnssSensor::Impl::observe(const gazebo::common::Time& now, const TruePose& truth,
                               ReceiverReport& report) {
  const Vector3d arm = truth.pose.attitude * settings.live.receiver.lever_arm_m;
  report.antenna_world_m = truth.pose.position_m + arm;
  report.link_attitude_world = truth.pose.attitude;

  simulation::AntennaState antenna;
  antenna.position_enu_m = enu_from_world * report.antenna_world_m;
  antenna.velocity_enu_mps = enu_from_world * (truth.linear_velocity + truth.angular_velocity.cross(arm));
  antenna.yaw_rad = yaw_of(truth.pose.attitude) + frame.heading_rad;
  antenna.yaw_rate_radps = truth.angular_velocity.z();

  if (geometry) bring_scene_up_to_date();
  ranges.clear();
  step = receiver->observe(now.Double(), antenna);
  if (!settings.publish_scan) return;
  report.scan_max_range_m = physics ? kPhysicsReach_m : std::numeric_limits<double>::infinity();
  report.scan_ranges_m = physics ? ranges : scan_by_embree(antenna.position_enu_m);
}

void GnssSensor::Impl::bring_scene_up_to_date() {
  geometry->update(left_out);
  if (!has_scene || geometry->generation() != generation) {
    receiver->set_scene(geometry->scene());
    generation = geometry->generation();
    has_scene = true;
  }
  for (const std::string& line : geometry->take_notes()) warn(line);
}

// The paper's algorithm on the physics engine: for each satellite the direct ray, then the mirror ray.
void GnssSensor::Impl::trace_by_physics(const Vector3d& antenna_enu, std::span<const Vector3d> directions,
                                        std::span<propagation::SatellitePaths> result) {
  const Eigen::Matrix3d world_from_enu = enu_from_world.transpose();
  const Vector3d origin = world_from_enu * antenna_enu;
  const double mirror_reach_m = settings.live.receiver.propagation.max_range_m;
  rays.clear();
  for (const Vector3d& direction : directions) {
    rays.push_back({origin, world_from_enu * direction, kPhysicsReach_m});
    rays.push_back({origin, world_from_enu * propagation::mirror_direction(direction), mirror_reach_m});
  }
  ranges.resize(rays.size());
  physics->cast(rays, left_out, ranges);
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const double mirror = ranges[2 * i + 1];
    result[i] = propagation::mirror_paths(antenna_enu, directions[i], std::isfinite(ranges[2 * i]),
                                          std::isfinite(mirror) ? std::optional(mirror) : std::nullopt);
  }
}

// The same rays through the engine's scene, for the scan alone.
std::vector<double> GnssSensor::Impl::scan_by_embree(const Vector3d& antenna_enu) const {
  const raytrace::RayScene& scene = geometry->scene()->scene;
  const double min_range = scene.surface_offset_m(antenna_enu);
  const Eigen::Matrix3d enu_from_ecef = frame.enu.ecef_from_local_rotation().transpose();
  const auto range = [&](const Vector3d& direction, double reach_m) {
    const auto hit = scene.cast({antenna_enu, direction, reach_m}, min_range);
    return hit ? hit->range_m : std::numeric_limits<double>::infinity();
  };
  std::vector<double> scan;
  scan.reserve(2 * step->arrival.views.size());
  for (const propagation::SatelliteView& view : step->arrival.views) {
    const Vector3d direction = enu_from_ecef * view.line.direction_ecef;
    scan.push_back(range(direction, std::numeric_limits<double>::infinity()));
    scan.push_back(
        range(propagation::mirror_direction(direction), settings.live.receiver.propagation.max_range_m));
  }
  return scan;
}

GnssSensor::GnssSensor(const Attachment& attachment) : impl_(std::make_unique<Impl>(attachment)) {}
GnssSensor::~GnssSensor() = default;

std::unique_ptr<GnssSensor> load_gnss_sensor(const Attachment& attachment) noexcept {
  try {
    return std::make_unique<GnssSensor>(attachment);
  } catch (const std::exception& e) {
    gzerr << "[canyon] " << e.what() << "\n[canyon] the receiver is switched off; the simulation goes on\n";
  } catch (...) {
    gzerr << "[canyon] the receiver could not be loaded; the simulation goes on\n";
  }
  return nullptr;
}

}  // namespace canyon::adapters::gazebo_classic
