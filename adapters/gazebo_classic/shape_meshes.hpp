#pragma once

#include <cstdint>
#include <gazebo/physics/PhysicsTypes.hh>
#include <string>
#include <vector>

#include "canyon/city/city.hpp"

namespace canyon::adapters::gazebo_classic {

/// Turns the shapes of Gazebo's links into triangles.
class ShapeMeshes {
 public:
  /// @param visual visuals instead of collisions
  /// @param physics_engine gazebo::physics::PhysicsEngine::GetType(): states which way rows of heightmaps run
  ShapeMeshes(bool visual, const std::string& physics_engine);

  /// All shapes of a link [m], in the link's frame, as LinkShapes::take() says; names are
  /// "model::link::collision". Shapes that cannot be taken go to `notes`, one line each.
  [[nodiscard]] city::Mesh link_mesh(const gazebo::physics::Link& link,
                                     std::vector<std::string>& notes) const;

  /// Changes where a shape of the link changes: kind, size, scale, mesh, place, number. Heights of heightmaps
  /// are not looked at.
  [[nodiscard]] std::uint64_t fingerprint(const gazebo::physics::Link& link) const;

 private:
  bool visual_;
  bool north_first_;  ///< rows of heightmaps
};

}  // namespace canyon::adapters::gazebo_classic
