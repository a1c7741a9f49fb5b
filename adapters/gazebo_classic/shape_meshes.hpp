#pragma once

#include <cstdint>
#include <gazebo/physics/PhysicsTypes.hh>
#include <string>
#include <unordered_map>
#include <vector>

#include "canyon/city/city.hpp"

namespace gazebo::common {
class Mesh;
}
namespace gazebo::msgs {
class Geometry;
}

namespace canyon::adapters::gazebo_classic {

/// A plane's sides are cut to this length about its origin, so that a "boundless" one leaves rays exact: see
/// RayScene's 10 km.
inline constexpr double kLargestPlane_m = 10'000;
/// A shape with a vertex farther than this from its link's origin is left out.
inline constexpr double kLargestShape_m = 50'000;
/// A heightmap of more heights than this along a side is thinned, where its number of cells can be divided.
inline constexpr int kFinestHeightmap = 1'025;

/// Turns the shapes of Gazebo's links into triangles. Remembers what it learned about mesh files; for one
/// thread.
class ShapeMeshes {
 public:
  /// @param visual visuals instead of collisions
  /// @param physics_engine gazebo::physics::PhysicsEngine::GetType(): tells which way rows of heightmaps run
  ShapeMeshes(bool visual, std::string physics_engine);

  /// All shapes of a link [m], in the link's frame, front sides outwards: one object for each primitive, each
  /// node of a mesh, each heightmap, named "model::link::collision" (for meshes "::node" follows) or, from
  /// meshes that Canyon wrote, as they were. What cannot be taken goes to `notes`, one line each.
  [[nodiscard]] city::Mesh link_mesh(const gazebo::physics::Link& link, std::vector<std::string>& notes);

  /// Changes where a shape of the link changes: kind, size, scale, mesh, place, number. Heights of heightmaps
  /// are not looked at.
  [[nodiscard]] std::uint64_t fingerprint(const gazebo::physics::Link& link) const;

 private:
  struct Target;
  /// `heightmap` (null: none) instead of `geometry`.
  void take(Target& target, const gazebo::msgs::Geometry& geometry,
            const gazebo::physics::HeightmapShape* heightmap);
  void add(Target& target, const gazebo::msgs::Geometry& geometry);
  void add_mesh_file(Target& target, const gazebo::msgs::Geometry& geometry);
  void add_polyline(Target& target, const gazebo::msgs::Geometry& geometry);
  void add_heightmap(Target& target, const gazebo::physics::HeightmapShape& shape) const;

  bool visual_;
  std::string physics_engine_;
  std::unordered_map<std::string, bool> marked_;  ///< by file: written by Canyon, see city::kMeshMark
};

}  // namespace canyon::adapters::gazebo_classic
