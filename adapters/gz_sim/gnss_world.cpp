#include "adapters/gz_sim/gnss_world.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <future>
#include <gz/common/Console.hh>
#include <gz/sim/Util.hh>
#include <gz/sim/components/AngularVelocity.hh>
#include <gz/sim/components/LinearVelocity.hh>
#include <gz/sim/components/Name.hh>
#include <gz/sim/components/NavSat.hh>
#include <gz/sim/components/Pose.hh>
#include <gz/sim/components/Sensor.hh>
#include <gz/sim/components/World.hh>
#include <map>
#include <mutex>
#include <optional>
#include <sdf/Sensor.hh>
#include <utility>
#include <vector>

#include "adapters/common/gazebo_math.hpp"
#include "adapters/common/sdf/plugin_settings.hpp"
#include "adapters/gz_sim/gnss_sensor.hpp"
#include "adapters/gz_sim/gz_host_world.hpp"
#include "adapters/gz_sim/options_service.hpp"
#include "adapters/gz_sim/publishers.hpp"
#ifdef CANYON_WITH_ROS2
#include "adapters/ros2/host_publisher.hpp"
#endif
#include "canyon/base/input_error.hpp"
#include "canyon/outputs/live/hosted_receiver.hpp"
#include "canyon/receiver/receiver.hpp"

namespace canyon::adapters::gz_sim {
namespace {

using Ecm = gz::sim::EntityComponentManager;
using gz::sim::Entity;
namespace components = gz::sim::components;

std::int64_t nanoseconds(const std::chrono::steady_clock::duration& time) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(time).count();
}

// Prints warnings as errors too: Gazebo Sim shows lower levels only on request.
void log(live::Severity tone, const std::string& line) {
  gzerr << "[canyon] " << (tone == live::Severity::Error ? "" : "warning: ") << line << "\n";
}

}  // namespace

struct GnssWorld::Impl {
  struct Receiver {
    Entity sensor = gz::sim::kNullEntity;
    Entity link = gz::sim::kNullEntity;
    std::string link_name;
    std::string name;  // "iris::base_link::gps"
    std::string topic;
    std::optional<live::HostWorld::Id> vehicle_model;
    bool scene_is_due = true;
    std::shared_ptr<live::WorldScene> scene;  // shared by receivers with the same options
    simulation::EngineMotion motion;
    std::shared_ptr<simulation::PoseInbox> poses;  // instead of the link's motion
    std::unique_ptr<gz::transport::Node> node;     // of their subscription
    HostSettings settings;
    std::unique_ptr<live::HostedReceiver> hosted;
  };
  struct Root {
    sdf::ElementPtr defaults;
    bool all = false;
    bool bad = false;     // `defaults` are invalid, already reported
    bool found = false;   // a sensor to serve was found
    bool looked = false;  // whether there is one was reported
  };
  /// A sensor for Canyon with its effective elements, whose receiver is to be started.
  struct Sensor {
    Entity entity = gz::sim::kNullEntity;
    sdf::Sensor sensor;
    sdf::ElementPtr element;
  };

  void take_over(Entity entity, const sdf::Sensor& sensor, Ecm& ecm) {
    // A sensor that is found when the system begins is also new in the first step.
    const bool waits =
        std::any_of(due.begin(), due.end(), [&](const Sensor& s) { return s.entity == entity; });
    if (waits || receivers.contains(entity)) return;
    const sdf::ElementPtr element = sensor.Element();
    if (!element) return;
    // The innermost system takes precedence: a model's over the world's.
    Root* root = nullptr;
    for (Entity at = entity; at != gz::sim::kNullEntity && root == nullptr; at = parent_of(at, ecm)) {
      const auto known = roots.find(at);
      if (known != roots.end()) root = &known->second;
    }
    const bool is_navsat = sensor.Type() == sdf::SensorType::NAVSAT;
    const bool is_gnss = !is_navsat && element->HasAttribute("gz:type") &&
                         element->GetAttribute("gz:type")->GetAsString() == "gnss";
    const bool is_marked = element->HasElement("canyon");
    if (root == nullptr || root->bad || !(is_gnss || (is_navsat && (is_marked || root->all)))) return;
    // Remove it now: Gazebo's own NavSat system would publish the truth on the same topic.
    ecm.RemoveComponent<components::NavSat>(entity);
    const sdf::ElementPtr own = is_marked ? element->GetElement("canyon") : nullptr;
    root->found = true;
    due.push_back({entity, sensor, with_defaults(own, root->defaults)});
  }

  // Called in the first step: a model that is being loaded has no world yet.
  void start_due(Ecm& ecm) {
    if (!due.empty()) wait();
    for (const Sensor& sensor : std::exchange(due, {})) {
      if (!ecm.HasEntity(sensor.entity) || receivers.contains(sensor.entity)) continue;
      try {
        start(sensor.entity, sensor.sensor, sensor.element, ecm);
      } catch (const std::exception& e) {
        log(live::Severity::Error,
            fmt::format("{}\n[canyon] the receiver is switched off; the simulation continues", e.what()));
      }
    }
    for (auto& [entity, root] : roots) {
      if (std::exchange(root.looked, true) || root.found || root.bad) continue;
      gzerr << "[canyon] no sensor to serve in '" << name_of(entity, ecm)
            << "' yet: a navsat sensor needs a <canyon> element (or the plugin <serve>all</serve>), another "
               "<sensor type=\"custom\" gz:type=\"gnss\">\n";
    }
  }

  void start(Entity entity, const sdf::Sensor& sensor, const sdf::ElementPtr& element, Ecm& ecm) {
    const ReceiverIdentity identity = identify(entity, ecm);
    check_sensor(sensor.Element(), receiver_label(identity));
    HostSettings settings = read_settings(element, sensor.Element(), identity, ecm);
    if (element->HasElement("topic"))
      settings.warnings.emplace_back("<topic> of <canyon> has no effect here: move it to <sensor>");
    origin = origin_of(ecm);
    if (!origin && !settings.origin) {
      throw InputError(
          receiver_label(identity) + ": the world has no geographic origin",
          "give it <spherical_coordinates>, or <canyon> <origin_latitude>, <origin_longitude> and "
          "<origin_altitude>");
    }
    const live::WorldFrame frame = world_frame(origin, settings, settings.warnings);

    if (!options) options = std::make_unique<OptionsService>(identity.world);
    Receiver receiver;
    receiver.sensor = entity;
    receiver.link = parent_of(entity, ecm);
    receiver.link_name = identity.link;
    receiver.name = identity.link + "::" + identity.sensor;
    if (!settings.vehicle_blocks) receiver.vehicle_model = gz::sim::topLevelModel(entity, ecm);
    gz::sim::enableComponent<components::WorldLinearVelocity>(ecm, receiver.link);
    gz::sim::enableComponent<components::WorldAngularVelocity>(ecm, receiver.link);
    if (!settings.pose_topic.empty()) {
      receiver.node = std::make_unique<gz::transport::Node>();
      receiver.poses = take_poses(*receiver.node, settings);
    }

    const bool topic_given = !sensor.Topic().empty();
    const std::string topic =
        gz::sim::validTopic({topic_given ? sensor.Topic() : gz::sim::scopedName(entity, ecm) + "/navsat"});
    for (const auto& [other, known] : receivers) {
      if (known.topic != topic) continue;
      settings.warnings.push_back(fmt::format(
          "the topic '{}' is also used by {}; give one of the sensors another <topic>", topic, known.name));
    }
    receiver.topic = topic;
    ecm.CreateComponent(entity, components::SensorTopic(topic));
    live::HostSetup setup = setup_of(settings, identity, frame, start_of_world(&ecm, identity.world, 0),
                                     sensor.UpdateRate(), log);
    setup.sky_warnings = sky_warnings;
    receiver.hosted = std::make_unique<live::HostedReceiver>(std::move(setup));
    if (settings.publish_navsat)
      receiver.hosted->add(make_navsat_publisher(topic, frame_of(sensor.Element(), receiver.name)));
    std::vector<std::string> topics;
    if (settings.publish_navsat) topics.push_back(topic);
    if (settings.publish_gazebo) {
      topics.push_back(gnss_topic_for(topic, topic_given));
      receiver.hosted->add(make_gnss_publisher(identity, topics.back()));
    }
#ifdef CANYON_WITH_ROS2
    if (settings.publish_ros) {
      receiver.hosted->add(ros2::make_host_publisher(identity, settings,
                                                     hosted_faults(options->desk(), receiver.name, settings)),
                           "cannot publish on ROS 2");
    }
#endif
    if (settings.show_rays || settings.show_bubble)
      receiver.hosted->add(make_markers(identity, settings), "rays and bubble are not drawn");
    const std::string services = options->add(receiver.name, topic);
    const auto rooted = [](const std::string& name) { return name.starts_with('/') ? name : "/" + name; };
    for (std::string& each : topics) each = rooted(each);
    gzmsg << "[canyon] " << receiver.name << " publishes on "
          << (topics.empty() ? "no topic" : fmt::format("{}", fmt::join(topics, " and "))) << " every "
          << receiver.hosted->interval_s() << " s; services " << rooted(topic) << "/set_rate and "
          << rooted(services) << "/get_options, set_options, get_faults, add_fault, end_fault\n";
    receiver.settings = std::move(settings);
    Receiver& kept = receivers[entity] = std::move(receiver);
    bases.add(*kept.hosted, gz::sim::topLevelModel(entity, ecm));
    kept.hosted->on_reset([&kept] {
      kept.motion.reset();
      if (kept.poses) kept.poses->reset();
    });
  }

  void look_for_sensors(Ecm& ecm, bool all) {
    // Lists sensors first, since components must not be created or removed in a loop over them.
    std::vector<std::pair<Entity, sdf::Sensor>> found;
    const auto add = [&](const Entity& entity, const components::Sensor*) {
      if (auto sensor = sdf_of(entity, ecm)) found.emplace_back(entity, std::move(*sensor));
      return true;
    };
    if (all)
      ecm.Each<components::Sensor>(add);
    else
      ecm.EachNew<components::Sensor>(add);
    for (const auto& [entity, sensor] : found) take_over(entity, sensor, ecm);
  }

  void remove(Entity entity) {
    const auto receiver = receivers.find(entity);
    if (receiver == receivers.end()) return;
    wait();
    options->remove(receiver->second.name);
    bases.remove(*receiver->second.hosted);
    receivers.erase(receiver);
  }

  // A reset removes entities without notice.
  void remove_gone(const Ecm& ecm) {
    std::vector<Entity> gone;
    for (const auto& [entity, receiver] : receivers)
      if (ecm.Component<components::Sensor>(entity) == nullptr) gone.push_back(entity);
    for (const Entity entity : gone) remove(entity);
  }

  // set_spherical_coordinates changes the world's position while it runs.
  void follow_origin(const Ecm& ecm) {
    const std::optional<live::HostOrigin> now = origin_of(ecm);
    if (now == origin) return;
    wait();
    origin = now;
    for (auto& [entity, receiver] : receivers) {
      std::vector<std::string> warnings;
      receiver.scene_is_due = true;
      try {
        receiver.hosted->set_frame(world_frame(origin, receiver.settings, warnings));
      } catch (const std::exception& e) {
        receiver.hosted->log(live::Severity::Error, e.what());
      }
      for (const std::string& line : warnings) receiver.hosted->log(live::Severity::Warning, line);
    }
  }

  void find_sensors(const Ecm& ecm) {
    for (auto& [entity, receiver] : receivers)
      if (receiver.scene) dynamic_cast<GzHostWorld&>(receiver.scene->world()).update_models(ecm);
  }

  void wait() {
    if (epochs.valid()) epochs.get();
  }

  [[nodiscard]] bool idle() const {
    return !epochs.valid() || epochs.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  }

  std::optional<simulation::RigidPose> truth(Receiver& receiver, std::int64_t now_ns, const Ecm& ecm,
                                             std::string& reason) const {
    if (receiver.poses) return receiver.poses->at(now_ns, reason);
    if (ecm.Component<components::Pose>(receiver.link) == nullptr) {
      reason = fmt::format("link {} no longer exists", receiver.link_name);
      return std::nullopt;
    }
    simulation::RigidPose engine = rigid_pose(gz::sim::worldPose(receiver.sensor, ecm));
    const auto linear = ecm.ComponentData<components::WorldLinearVelocity>(receiver.link);
    const auto angular = ecm.ComponentData<components::WorldAngularVelocity>(receiver.link);
    if (angular) engine.angular_velocity = eigen(*angular);
    if (linear) {
      const Eigen::Vector3d arm = engine.position_m - eigen(gz::sim::worldPose(receiver.link, ecm).Pos());
      engine.linear_velocity = eigen(*linear) + engine.angular_velocity.cross(arm);
    }
    const auto motion = receiver.motion.at(now_ns, engine);
    if (!motion) reason = fmt::format("Gazebo has no finite pose of link {}", receiver.link_name);
    return motion;
  }

  std::mutex mutex;
  std::map<Entity, Root> roots;
  std::vector<Sensor> due;
  std::map<Entity, Receiver> receivers;  // in the order of entities, so that runs are repeatable
  live::HostBases bases;
  std::shared_ptr<live::SkyWarnings> sky_warnings = std::make_shared<live::SkyWarnings>();
  std::unique_ptr<OptionsService> options;
  std::optional<live::HostOrigin> origin;
  bool stepped = false;  // PostUpdate of this step has been called
  // Epochs are computed and published while the simulation continues; it waits only before the next ones.
  std::future<void> epochs;
};

GnssWorld::GnssWorld() : impl_(std::make_unique<Impl>()) {}
GnssWorld::~GnssWorld() = default;

std::shared_ptr<GnssWorld> GnssWorld::of(const Ecm& ecm) {
  // Never destroyed: plugins may be unloaded after static objects are gone.
  static auto& mutex = *new std::mutex;
  static auto& known = *new std::map<const Ecm*, std::weak_ptr<GnssWorld>>;
  const std::lock_guard lock(mutex);
  std::weak_ptr<GnssWorld>& weak = known[&ecm];
  std::shared_ptr<GnssWorld> world = weak.lock();
  if (!world) weak = world = std::make_shared<GnssWorld>();
  return world;
}

void GnssWorld::serve(Entity root, const sdf::ElementPtr& defaults, Ecm& ecm) {
  const std::lock_guard lock(impl_->mutex);
  Impl::Root& entry = impl_->roots[root];
  entry.defaults = defaults;
  try {
    PluginContext context;
    context.name = "plugin 'canyon::GnssSystem'";
    context.resources = gazebos_paths();
    entry.all = read_plugin_settings(defaults, context).serve_all;
  } catch (const std::exception& e) {
    entry.bad = true;
    log(live::Severity::Error,
        fmt::format("{}\n[canyon] its receivers are switched off; the simulation continues", e.what()));
  }
  impl_->look_for_sensors(ecm, true);
}

void GnssWorld::leave(Entity root) {
  const std::lock_guard lock(impl_->mutex);
  impl_->roots.erase(root);
}

void GnssWorld::update(const gz::sim::UpdateInfo&, Ecm& ecm) {
  const std::lock_guard lock(impl_->mutex);
  impl_->stepped = false;
  impl_->remove_gone(ecm);
  if (ecm.HasNewEntities()) impl_->look_for_sensors(ecm, false);
  impl_->start_due(ecm);
}

void GnssWorld::post_update(const gz::sim::UpdateInfo& info, const Ecm& ecm) {
  const std::lock_guard lock(impl_->mutex);
  if (std::exchange(impl_->stepped, true)) return;
  ecm.EachRemoved<components::Sensor>([&](const Entity& entity, const components::Sensor*) {
    impl_->remove(entity);
    return true;
  });
  if (impl_->options) {
    impl_->options->serve([this] {
      impl_->wait();
      std::vector<live::ReceiverHandle> all;
      for (auto& [entity, receiver] : impl_->receivers)
        all.push_back(receiver.hosted->receiver_handle(receiver.name));
      return all;
    });
  }
  if (impl_->receivers.empty()) return;
  impl_->find_sensors(ecm);
  impl_->follow_origin(ecm);
  const std::int64_t now_ns = nanoseconds(info.simTime);
  if (impl_->idle())
    for (auto& [entity, receiver] : impl_->receivers) receiver.hosted->serve(now_ns);
  if (info.paused) return;
  std::vector<Impl::Receiver*> due;
  for (auto& [entity, receiver] : impl_->receivers) {
    if (receiver.poses) receiver.poses->step(now_ns);
    if (receiver.hosted->due(now_ns)) due.push_back(&receiver);
  }
  if (due.empty()) return;
  impl_->wait();
  for (Impl::Receiver* receiver : due) {
    live::HostedReceiver& hosted = *receiver->hosted;
    if (std::exchange(receiver->scene_is_due, false)) {
      receiver->settings.live.seed = hosted.receiver().config().seed;
      const auto options =
          scene_options(name_of(gz::sim::worldEntity(ecm), ecm), receiver->settings, hosted.frame());
      receiver->scene = live::WorldScene::of(
          impl_.get(), options, [&options] { return std::make_unique<GzHostWorld>(options.visual); });
      hosted.set_scene(receiver->scene, receiver->vehicle_model);
      impl_->find_sensors(ecm);
    }
    hosted.begin(now_ns, [&](std::string& reason) { return impl_->truth(*receiver, now_ns, ecm, reason); });
  }
  std::vector<live::HostedReceiver*> started_receivers;
  for (Impl::Receiver* receiver : due) started_receivers.push_back(receiver->hosted.get());
  impl_->epochs = std::async(std::launch::async,
                             [bases = &impl_->bases, started_receivers = std::move(started_receivers)] {
                               bases->finish(started_receivers);
                             });
}

void GnssWorld::reset(Ecm& ecm) {
  const std::lock_guard lock(impl_->mutex);
  impl_->wait();
  impl_->remove_gone(ecm);
  for (auto& [entity, receiver] : impl_->receivers) {
    ecm.RemoveComponent<components::NavSat>(entity);
    receiver.hosted->reset();
  }
  impl_->look_for_sensors(ecm, true);
}

}  // namespace canyon::adapters::gz_sim
