#include "adapters/gazebo_classic/gnss_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <gazebo/common/Console.hh>
#include <gazebo/common/Events.hh>
#include <gazebo/physics/physics.hh>
#include <gazebo/sensors/RaySensor.hh>
#include <gazebo/sensors/Sensor.hh>
#include <gazebo/transport/Node.hh>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "adapters/common/sdf/plugin_settings.hpp"
#include "adapters/gazebo_classic/ignition_types.hpp"
#include "adapters/gazebo_classic/physics_rays.hpp"
#include "adapters/gazebo_classic/pose_source.hpp"
#include "adapters/gazebo_classic/publishers.hpp"
#include "adapters/gazebo_classic/world_geometry.hpp"
#include "canyon/outputs/live/hosted_receiver.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#ifdef CANYON_WITH_ROS2
#include "adapters/ros2/host_publisher.hpp"
#endif

namespace canyon::adapters::gazebo_classic {
namespace {

using Eigen::Vector3d;

// Rays of a physics engine have a finite length. At this distance a roof that blocks a satellite at 10 deg
// elevation is 870 m high.
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

HostSettings read_settings(const Attachment& at, const ReceiverIdentity& identity, bool on_ray_sensor) {
  PluginContext context;
  context.on_ray_sensor = on_ray_sensor;
  context.name = receiver_label(identity);
  context.folder = std::filesystem::path(at.sdf->FilePath()).parent_path();
  context.resources = gazebos_paths();
  context.sensor = at.sdf->GetParent();
  return read_plugin_settings(at.sdf, context);
}

void log(live::Severity tone, const std::string& line) {
  if (tone == live::Severity::Error)
    gzerr << "[canyon] " << line << "\n";
  else
    gzwarn << "[canyon] " << line << "\n";
}

}  // namespace

struct GnssSensor::Impl {
  /// The receivers of one world. At the end of an update all begin their epochs, then bases finish before the
  /// receivers that use their corrections. Plugins are added and removed in other threads than updates.
  class World {
   public:
    static std::shared_ptr<World> of(const gazebo::physics::WorldPtr& world);
    World() : connection_(gazebo::event::Events::ConnectWorldUpdateEnd([this] { update(); })) {}
    void add(Impl& receiver);
    void remove(Impl& receiver);
    const std::shared_ptr<live::SkyWarnings> sky_warnings = std::make_shared<live::SkyWarnings>();

   private:
    void update();

    std::mutex mutex_;
    std::vector<Impl*> receivers_;
    live::HostBases bases_;
    gazebo::event::ConnectionPtr connection_;
  };

  explicit Impl(const Attachment& attachment) : at(attachment) {
    const ReceiverIdentity identity = identify(at);
    const auto ray_sensor = std::dynamic_pointer_cast<gazebo::sensors::RaySensor>(at.sensor);
    HostSettings settings = read_settings(at, identity, ray_sensor != nullptr);
    const live::WorldFrame frame = world_frame(origin_of(*at.world), settings, settings.warnings);
    world = World::of(at.world);
    live::HostSetup setup =
        setup_of(settings, identity, frame,
                 start_of_world(at.world.get(), at.world->Name(), nanoseconds(at.world->SimTime())),
                 at.sensor ? at.sensor->UpdateRate() : 0, log);
    setup.sky_warnings = world->sky_warnings;
    receiver.emplace(std::move(setup));

    if (!settings.vehicle_blocks) left_out = at.link->GetParentModel();
    if (settings.ray_engine == RayEngine::Physics) {
      physics = std::make_unique<PhysicsRays>(at.link, ray_sensor, identity.plugin);
      receiver->set_tracer(
          [this](const Vector3d& antenna, std::span<const Vector3d> directions,
                 std::span<propagation::SatellitePaths> result) {
            trace_by_physics(antenna, directions, result);
          },
          [this] { return ranges; }, kPhysicsReach_m);
    } else {
      receiver->set_scene(scene_of(at.world, scene_options(at.world->Name(), settings, frame)),
                          left_out ? std::optional(topmost_id(left_out)) : std::nullopt);
    }

    node = gazebo::transport::NodePtr(new gazebo::transport::Node());
    node->Init(at.world->Name());
    pose_source =
        settings.pose_topic.empty()
            ? make_link_pose_source(at.link, at.sensor ? at.sensor->Pose() : ignition::math::Pose3d::Zero)
            : make_topic_pose_source(node, settings);
    receiver->on_reset([this] { pose_source->reset(); });
    if (settings.publish_gazebo) receiver->add(make_gazebo_publisher(node, identity));
    if (settings.publish_px4) receiver->add(make_px4_publisher(node, identity, settings));
    if (settings.show_rays || settings.show_bubble) receiver->add(make_visuals(node, identity, settings));
    if (settings.publish_ros) {
      name = identity.link + "::" + (identity.sensor.empty() ? identity.plugin : identity.sensor);
#if defined(CANYON_WITH_ROS)
      receiver->add(make_ros_publisher(identity, settings, hosted_faults(desk, name, settings)));
#elif defined(CANYON_WITH_ROS2)
      receiver->add(ros2::make_host_publisher(identity, settings, hosted_faults(desk, name, settings)),
                    "cannot publish on ROS 2");
#endif
    }
    world->add(*this);
  }

  ~Impl() {
    world->remove(*this);
    desk->close();
    receiver.reset();
    pose_source.reset();
    if (node) node->Fini();  // unadvertises its topics
  }

  /// Whether an epoch is in progress.
  bool update() {
    // The model was removed; a sensor's plugin is removed some time later.
    if (!at.link->GetParent()) return false;
    desk->serve([this] { return std::vector{receiver->receiver_handle(name)}; });
    const gazebo::common::Time now = at.world->SimTime();
    const bool due = receiver->due(nanoseconds(now));
    if (due)
      receiver->begin(nanoseconds(now), [&](std::string& reason) { return pose_source->at(now, reason); });
    else
      receiver->serve(nanoseconds(now));
    return due;
  }

  // The paper's algorithm on the physics engine: for each satellite the direct ray, then the mirror ray.
  void trace_by_physics(const Vector3d& antenna_enu, std::span<const Vector3d> directions,
                        std::span<propagation::SatellitePaths> result) {
    const Eigen::Matrix3d world_from_enu = receiver->frame().enu_from_world().transpose();
    const Vector3d origin = world_from_enu * antenna_enu;
    const double mirror_reach_m = receiver->receiver().config().receiver().propagation.max_range_m;
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

  Attachment at;
  std::string name;  // "iris::gps0::link::gps", for requests
  std::shared_ptr<live::RequestQueue> desk = std::make_shared<live::RequestQueue>();  // from any thread
  gazebo::transport::NodePtr node;
  std::unique_ptr<PoseSource> pose_source;
  std::unique_ptr<PhysicsRays> physics;
  std::vector<PhysicsRay> rays;  // of the physics engine, with ranges
  std::vector<double> ranges;
  gazebo::physics::ModelPtr left_out;
  std::optional<live::HostedReceiver> receiver;
  std::shared_ptr<World> world;
};

std::shared_ptr<GnssSensor::Impl::World> GnssSensor::Impl::World::of(const gazebo::physics::WorldPtr& world) {
  // Never destroyed: plugins may be unloaded after static objects are gone.
  static auto& mutex = *new std::mutex;
  static auto& known = *new std::map<const gazebo::physics::World*, std::weak_ptr<World>>;
  const std::lock_guard lock(mutex);
  std::weak_ptr<World>& weak = known[world.get()];
  std::shared_ptr<World> one = weak.lock();
  if (!one) weak = one = std::make_shared<World>();
  return one;
}

void GnssSensor::Impl::World::add(Impl& receiver) {
  const std::lock_guard lock(mutex_);
  receivers_.push_back(&receiver);
  bases_.add(*receiver.receiver, receiver.at.link->GetParentModel()->GetId());
}

void GnssSensor::Impl::World::remove(Impl& receiver) {
  const std::lock_guard lock(mutex_);
  receivers_.erase(std::remove(receivers_.begin(), receivers_.end(), &receiver), receivers_.end());
  bases_.remove(*receiver.receiver);
}

void GnssSensor::Impl::World::update() {
  const std::lock_guard lock(mutex_);
  std::vector<live::HostedReceiver*> started_receivers;
  for (Impl* receiver : receivers_)
    if (receiver->update()) started_receivers.push_back(&*receiver->receiver);
  bases_.finish(std::move(started_receivers));
}

GnssSensor::GnssSensor(const Attachment& attachment) : impl_(std::make_unique<Impl>(attachment)) {}
GnssSensor::~GnssSensor() = default;

std::unique_ptr<GnssSensor> load_gnss_sensor(const Attachment& attachment) noexcept {
  try {
    return std::make_unique<GnssSensor>(attachment);
  } catch (const std::exception& e) {
    gzerr << "[canyon] " << e.what() << "\n[canyon] the receiver is switched off; the simulation continues\n";
  } catch (...) {
    gzerr << "[canyon] the receiver could not be loaded; the simulation continues\n";
  }
  return nullptr;
}

}  // namespace canyon::adapters::gazebo_classic
