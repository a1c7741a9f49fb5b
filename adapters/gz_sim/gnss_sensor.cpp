#include "adapters/gz_sim/gnss_sensor.hpp"

#include <gz/msgs/pose.pb.h>

#include <filesystem>
#include <functional>
#include <gz/common/Console.hh>
#include <gz/sim/Util.hh>
#include <gz/sim/components/CustomSensor.hh>
#include <gz/sim/components/Model.hh>
#include <gz/sim/components/Name.hh>
#include <gz/sim/components/NavSat.hh>
#include <gz/sim/components/ParentEntity.hh>
#include <gz/sim/components/World.hh>
#include <sdf/Link.hh>
#include <sdf/Model.hh>
#include <sdf/World.hh>
#include <vector>

#include "adapters/gz_sim/gz_host_world.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::adapters::gz_sim {

using Ecm = gz::sim::EntityComponentManager;
using gz::sim::Entity;
namespace components = gz::sim::components;

std::string name_of(Entity entity, const Ecm& ecm) {
  return ecm.ComponentData<components::Name>(entity).value_or("");
}

Entity parent_of(Entity entity, const Ecm& ecm) {
  return ecm.ComponentData<components::ParentEntity>(entity).value_or(gz::sim::kNullEntity);
}

std::optional<sdf::Sensor> sdf_of(Entity sensor, const Ecm& ecm) {
  if (const auto* navsat = ecm.Component<components::NavSat>(sensor)) return navsat->Data();
  const auto* custom = ecm.Component<components::CustomSensor>(sensor);
  if (custom != nullptr && custom->Data().Element()) return custom->Data();
  // A world played back from a log has the SDF of models only.
  const Entity link = parent_of(sensor, ecm), top = gz::sim::topLevelModel(sensor, ecm);
  const auto* model_entry = ecm.Component<components::ModelSdf>(top);
  if (model_entry == nullptr) return std::nullopt;
  std::vector<std::string> nested;
  for (Entity at = parent_of(link, ecm); at != top && at != gz::sim::kNullEntity; at = parent_of(at, ecm))
    nested.push_back(name_of(at, ecm));
  const sdf::Model* model = &model_entry->Data();
  for (auto name = nested.rbegin(); name != nested.rend() && model != nullptr; ++name)
    model = model->ModelByName(*name);
  const sdf::Link* in_model = model == nullptr ? nullptr : model->LinkByName(name_of(link, ecm));
  const sdf::Sensor* found = in_model == nullptr ? nullptr : in_model->SensorByName(name_of(sensor, ecm));
  return found == nullptr ? std::nullopt : std::optional(*found);
}

ReceiverIdentity identify(Entity sensor, const Ecm& ecm) {
  const Entity link = parent_of(sensor, ecm);
  ReceiverIdentity identity;
  identity.world = name_of(gz::sim::worldEntity(ecm), ecm);
  identity.model = name_of(gz::sim::topLevelModel(sensor, ecm), ecm);
  identity.parent = name_of(parent_of(link, ecm), ecm);
  identity.link = gz::sim::removeParentScope(gz::sim::scopedName(link, ecm, "::", false), "::");
  identity.sensor = name_of(sensor, ecm);
  identity.plugin = "canyon";
  return identity;
}

HostSettings read_settings(const sdf::ElementPtr& element, const sdf::ElementPtr& sensor,
                           const ReceiverIdentity& identity, const Ecm& ecm) {
  PluginContext context;
  context.sensor = sensor;
  context.name = receiver_label(identity);
  const auto world = ecm.ComponentData<components::WorldSdf>(gz::sim::worldEntity(ecm));
  if (world && world->Element())
    context.folder = std::filesystem::path(world->Element()->FilePath()).parent_path();
  context.resources = gazebos_paths();
  HostSettings settings = read_plugin_settings(element, context);
  if (settings.ray_engine == RayEngine::Physics) {
    throw InputError(context.name + ": <ray_engine>: Gazebo Sim's physics engines cast no rays for sensors",
                     "write <ray_engine>embree</ray_engine>");
  }
  if (settings.publish_px4) {
    settings.warnings.emplace_back(
        "<publishers><px4> without effect: PX4's bridge of Gazebo Sim reads the sensor's own topic");
  }
  return settings;
}

std::shared_ptr<simulation::PoseInbox> take_poses(gz::transport::Node& node, const HostSettings& settings) {
  // A call from the transport may still be in progress when the receiver has ended.
  auto inbox = std::make_shared<simulation::PoseInbox>(settings.pose_topic, settings.pose_timeout_s);
  std::function<void(const gz::msgs::Pose&)> take =
      [poses = std::weak_ptr<simulation::PoseInbox>(inbox)](const gz::msgs::Pose& message) {
        const auto kept = poses.lock();
        if (!kept) return;
        const auto& p = message.position();
        const auto& q = message.orientation();
        const auto& stamp = message.header().stamp();
        const double stamp_s = static_cast<double>(stamp.sec()) + static_cast<double>(stamp.nsec()) * 1e-9;
        const std::string logged = kept->take({{p.x(), p.y(), p.z()}, {q.w(), q.x(), q.y(), q.z()}}, stamp_s);
        if (!logged.empty()) gzerr << "[canyon] " << logged << "\n";
      };
  if (!node.Subscribe(settings.pose_topic, take))
    gzerr << "[canyon] <pose_topic>: Gazebo cannot subscribe to '" << settings.pose_topic << "'\n";
  return inbox;
}

}  // namespace canyon::adapters::gz_sim
