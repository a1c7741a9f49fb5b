#pragma once

#include <cstdint>
#include <gazebo/physics/PhysicsTypes.hh>
#include <string>
#include <vector>

#include "canyon/city/city.hpp"

namespace canyon::adapters::gazebo_classic {

/// Converts the shapes of Gazebo's links to triangles.
class ShapeMeshes {
 public:
  /// @param visual visuals instead of collisions
  /// @param physics_engine physics::PhysicsEngine::GetType(): determines the direction of heightmap rows
  ShapeMeshes(bool visual, const std::string& physics_engine);

  /// All shapes of a link [m], in the link's frame, see LinkShapes::take(); names are
  /// "model::link::collision". Omitted shapes are listed in `notes`, one line each.
  [[nodiscard]] city::Mesh link_mesh(const gazebo::physics::Link& link,
                                     std::vector<std::string>& notes) const;

  /// Changes if a shape changes: kind, size, scale, mesh, pose, number. Ignores heights of heightmaps.
  [[nodiscard]] std::uint64_t fingerprint(const gazebo::physics::Link& link) const;

 private:
  bool visual_;
  bool north_first_;  ///< rows of heightmaps
};

}  // namespace canyon::adapters::gazebo_classic
