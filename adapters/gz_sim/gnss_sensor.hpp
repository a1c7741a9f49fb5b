#pragma once

#include <gz/sim/EntityComponentManager.hh>
#include <gz/transport/Node.hh>
#include <memory>
#include <optional>
#include <sdf/Sensor.hh>
#include <string>

#include "adapters/common/sdf/plugin_settings.hpp"
#include "canyon/simulation/motion/pose_motion.hpp"

namespace canyon::adapters::gz_sim {

/// Name of an entity; empty without one.
[[nodiscard]] std::string name_of(gz::sim::Entity entity, const gz::sim::EntityComponentManager& ecm);
/// kNullEntity without one.
[[nodiscard]] gz::sim::Entity parent_of(gz::sim::Entity entity, const gz::sim::EntityComponentManager& ecm);

/// The sensor's SDF with its elements; empty for sensors of other kinds.
[[nodiscard]] std::optional<sdf::Sensor> sdf_of(gz::sim::Entity sensor,
                                                const gz::sim::EntityComponentManager& ecm);
/// The receiver of a sensor, by the names of the world, model, link and sensor.
[[nodiscard]] ReceiverIdentity identify(gz::sim::Entity sensor, const gz::sim::EntityComponentManager& ecm);
/// Settings of a receiver on `sensor`; those without effect in Gazebo Sim are warnings. Throws InputError.
[[nodiscard]] HostSettings read_settings(const sdf::ElementPtr& element, const sdf::ElementPtr& sensor,
                                         const ReceiverIdentity& identity,
                                         const gz::sim::EntityComponentManager& ecm);

/// External truth: gz.msgs.Pose on settings.pose_topic, in the world's frame, while `node` and result live.
[[nodiscard]] std::shared_ptr<simulation::PoseInbox> take_poses(gz::transport::Node& node,
                                                                const HostSettings& settings);

}  // namespace canyon::adapters::gz_sim
