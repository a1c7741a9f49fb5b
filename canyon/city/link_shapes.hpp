#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/city/mesh_topology.hpp"

namespace canyon::city {

/// Triangles on their own, front sides outwards; metres.
struct TriangleSet {
  std::vector<Eigen::Vector3d> vertices;
  TriangleIndices triangles;
};

[[nodiscard]] inline bool is_extent(const Eigen::Vector3d& lengths) {
  return lengths.allFinite() && lengths.minCoeff() > 0;
}

// Solids without extent have no triangles.
/// A box about the origin.
[[nodiscard]] TriangleSet box_mesh(const Eigen::Vector3d& size);
/// A closed prism inscribed in a cylinder about the origin, axis z, with so many sides: its radius is met at
/// the edges and short by a factor cos(pi / sides) between them (0.5 % for 32).
[[nodiscard]] TriangleSet cylinder_mesh(double radius, double length, int sides = 32);
/// A closed polyhedron inscribed in a sphere about the origin: `sides` meridians, half as many parallels.
[[nodiscard]] TriangleSet sphere_mesh(double radius, int sides = 32);
/// A closed pyramid inscribed in a cone about the origin: its base at -length / 2, its tip at length / 2 of
/// z.
[[nodiscard]] TriangleSet cone_mesh(double radius, double length, int sides = 32);
/// A closed polyhedron inscribed in a cylinder about the origin, axis z, between two half spheres; `length`
/// of the cylinder alone, 0 or more. `sides`, a multiple of 4, as of cylinder and sphere.
[[nodiscard]] TriangleSet capsule_mesh(double radius, double length, int sides = 32);
/// sphere_mesh() stretched to half axes `radii` along x, y and z.
[[nodiscard]] TriangleSet ellipsoid_mesh(const Eigen::Vector3d& radii, int sides = 32);
/// A rectangle about the origin in the plane of a unit normal, front side where the normal points. Its axes
/// are x and y turned the shortest way from z to the normal.
[[nodiscard]] TriangleSet plane_mesh(const Eigen::Vector3d& normal, const Eigen::Vector2d& size);

/// A plane's sides are cut to this length about its origin, so that a "boundless" one leaves rays exact: see
/// RayScene's 10 km.
inline constexpr double kLargestPlane_m = 10'000;
/// A shape with a vertex farther than this from its link's origin is left out.
inline constexpr double kLargestShape_m = 50'000;
/// A heightmap of more heights than this along a side is thinned, where its number of cells can be divided.
inline constexpr int kFinestHeightmap = 1'025;

/// Triangles of a mesh file that have one name and one material.
struct MeshNode {
  std::string name;
  std::vector<Eigen::Vector3d> vertices;  ///< in the file's frame [m]
  TriangleIndices triangles;  ///< those with an index out of range are left out; empty: lines, points
  std::optional<std::array<double, 3>> colour;  ///< diffuse red, green, blue in [0, 1]
};

/// A mesh file as the host reads it, so that rays meet the triangles that the host shows.
struct MeshFile {
  std::vector<MeshNode> nodes;  ///< a node of several materials is several of its name, one behind the other
  bool marked = false;          ///< has_mesh_mark()
};

/// Options of SDF's <mesh> beside the file.
struct MeshUse {
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();  ///< negative: mirrored
  std::string submesh;                              ///< only nodes of this name; empty: all
  bool center = false;                              ///< the middle of a chosen node's bounds to the origin
};

/// A regular grid of heights about a position.
struct HeightGrid {
  int columns = 0, rows = 0;                           ///< numbers of heights; at least 2
  std::function<double(int column, int row)> height;   ///< above the position [m]; columns go along x
  bool north_first = true;                             ///< row 0 at the largest y; else at the smallest
  Eigen::Vector2d size = Eigen::Vector2d::Zero();      ///< from the first to the last column and row [m]
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of the grid's middle in the shape's frame [m]
};

using Polyline = std::vector<Eigen::Vector2d>;  ///< corners of a closed path [m]
/// A host's own extrusion from 0 to `height` [m], so that holes are what the host makes of them; empty where
/// it cannot. Equal polylines come with an equal `name`.
using Extrude = std::function<std::optional<MeshNode>(const std::string& name,
                                                      const std::vector<Polyline>& polylines, double height)>;

/// Gathers the shapes of one link of a simulator as triangles.
class LinkShapes {
 public:
  /// Where a shape is and what it is called.
  struct Place {
    std::string name;
    Eigen::Affine3d link_from_shape = Eigen::Affine3d::Identity();
    Material material = Material::Unknown;
  };

  /// Shapes that cannot be taken are named in `notes`, one line each: "'NAME' is left out: WHY".
  explicit LinkShapes(std::vector<std::string>& notes) : notes_(notes) {}

  // SDF's shapes about their origins, axis z [m]. Those without extent are left out.
  /// @param what "a box", for the note on one without triangles
  void solid(const Place& place, std::string_view what, const TriangleSet& set);
  void plane(const Place& place, const Eigen::Vector3d& normal, Eigen::Vector2d size);
  /// A submesh that is not there leaves the whole mesh, with a note.
  void mesh(const Place& place, const MeshFile& file, const MeshUse& use);
  /// The first polyline is the outline, others are its holes.
  void polylines(const Place& place, const std::vector<Polyline>& polylines, double height,
                 const Extrude& extrude);
  void heights(const Place& place, const HeightGrid& grid);

  /// Notes on shapes that never came here, and other notes on a shape: "'NAME' WHAT".
  void leave_out(const Place& place, std::string_view why) const;
  void note(const Place& place, std::string_view what) const;

  /// All shapes [m], in the link's frame, front sides outwards: one object for each primitive, each node of a
  /// mesh, each grid, named as its place (for meshes "::node" follows) or, from files that Canyon wrote, as
  /// they were. Terrain by its name, a building else.
  [[nodiscard]] Mesh take() { return std::move(mesh_); }

 private:
  struct Soup;
  void add(const Place& place, const TriangleSet& set, bool orient_it = false);
  void append(const Place& place, const std::string& object, Surface surface, Soup soup,
              const Eigen::Affine3d& link_from_soup, bool orient_it);

  std::vector<std::string>& notes_;
  Mesh mesh_;
};

/// The material with this diffuse colour, which Canyon's own files give each material; Unknown for any other.
[[nodiscard]] Material material_by_colour(const std::array<double, 3>& colour);

}  // namespace canyon::city
