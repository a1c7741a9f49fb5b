#pragma once

#include <gazebo/physics/PhysicsTypes.hh>
#include <memory>
#include <optional>

#include "canyon/outputs/live/world_scene.hpp"

namespace canyon::adapters::gazebo_classic {

/// The scene of a Gazebo world that its receivers share. It holds the world weakly.
[[nodiscard]] std::shared_ptr<live::WorldScene> scene_of(const gazebo::physics::WorldPtr& world,
                                                         const live::WorldScene::Options& options);

/// Empty where the world has no spherical_coordinates.
[[nodiscard]] std::optional<live::HostOrigin> origin_of(const gazebo::physics::World& world);

/// The topmost model that `model` belongs to, as the scene knows it.
[[nodiscard]] live::HostWorld::Id topmost_id(const gazebo::physics::ModelPtr& model);

}  // namespace canyon::adapters::gazebo_classic
