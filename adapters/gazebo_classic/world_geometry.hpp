#pragma once

#include <gazebo/physics/PhysicsTypes.hh>
#include <memory>
#include <optional>

#include "canyon/outputs/live/world_scene.hpp"

namespace canyon::adapters::gazebo_classic {

/// The scene of a Gazebo world, shared by its receivers. It holds a weak reference to the world.
[[nodiscard]] std::shared_ptr<live::WorldScene> scene_of(const gazebo::physics::WorldPtr& world,
                                                         const live::WorldScene::Options& options);

/// Empty if the world has no spherical_coordinates.
[[nodiscard]] std::optional<live::HostOrigin> origin_of(const gazebo::physics::World& world);

/// The scene's ID of the topmost model of `model`.
[[nodiscard]] live::HostWorld::Id topmost_id(const gazebo::physics::ModelPtr& model);

}  // namespace canyon::adapters::gazebo_classic
