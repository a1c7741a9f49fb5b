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

/// A set of triangles, front sides outwards; metres.
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
/// A closed prism of `sides` sides inscribed in a cylinder about the origin, axis z: its edges have the
/// radius, its faces are closer by a factor cos(pi / sides) (0.5 % for 32).
[[nodiscard]] TriangleSet cylinder_mesh(double radius, double length, int sides = 32);
/// A closed polyhedron inscribed in a sphere about the origin: `sides` meridians, half as many parallels.
[[nodiscard]] TriangleSet sphere_mesh(double radius, int sides = 32);
/// A closed pyramid inscribed in a cone about the origin: base at z = -length / 2, tip at length / 2.
[[nodiscard]] TriangleSet cone_mesh(double radius, double length, int sides = 32);
/// A closed polyhedron inscribed in a cylinder about the origin, axis z, between two half spheres; `length`
/// is of the cylinder alone, 0 or more. `sides`, a multiple of 4, as for cylinder and sphere.
[[nodiscard]] TriangleSet capsule_mesh(double radius, double length, int sides = 32);
/// sphere_mesh() scaled to half axes `radii` along x, y and z.
[[nodiscard]] TriangleSet ellipsoid_mesh(const Eigen::Vector3d& radii, int sides = 32);
/// A rectangle about the origin in the plane of a unit normal, front side towards the normal. Its axes are x
/// and y, rotated by the smallest rotation that takes z to the normal.
[[nodiscard]] TriangleSet plane_mesh(const Eigen::Vector3d& normal, const Eigen::Vector2d& size);

/// A plane's sides are limited to this length about its origin, so that a "boundless" plane keeps ray casts
/// accurate: see RayScene's 10 km.
inline constexpr double kMaxPlane_m = 10'000;
/// A shape with a vertex farther than this from its link's origin is omitted.
inline constexpr double kMaxShape_m = 50'000;
/// A heightmap with more heights per side is thinned, if its number of cells is divisible.
inline constexpr int kFinestHeightmap = 1'025;

/// Triangles of a mesh file with the same name and material.
struct MeshNode {
  std::string name;
  std::vector<Eigen::Vector3d> vertices;  ///< in the file's frame [m]
  TriangleIndices triangles;              ///< without those with an index out of range; empty: lines, points
  std::optional<std::array<double, 3>> colour;  ///< diffuse red, green, blue in [0, 1]
};

/// A mesh file as read by the host, so that rays use the triangles that the host shows.
struct MeshFile {
  std::vector<MeshNode> nodes;  ///< a node of several materials becomes several adjacent nodes of its name
  bool marked = false;          ///< has_mesh_mark()
};

/// Options of SDF's <mesh> besides the file.
struct MeshUse {
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();  ///< negative: mirrored
  std::string submesh;                              ///< only nodes of this name; empty: all
  bool center = false;  ///< moves the middle of a chosen node's bounds to the origin
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
/// The host's own extrusion from 0 to `height` [m], so that holes are as in the host; empty if it fails.
/// Equal polylines have an equal `name`.
using Extrude = std::function<std::optional<MeshNode>(const std::string& name,
                                                      const std::vector<Polyline>& polylines, double height)>;

/// Collects the shapes of one link of a simulator as triangles.
class LinkShapes {
 public:
  /// The pose of a shape, and its name.
  struct ShapePose {
    std::string name;
    Eigen::Affine3d link_from_shape = Eigen::Affine3d::Identity();
    Material material = Material::Unknown;
  };

  /// Unsupported shapes are named in `notes`, one line each: "'NAME' is left out: WHY".
  explicit LinkShapes(std::vector<std::string>& notes) : notes_(notes) {}

  // SDF's shapes about their origins, axis z [m]. Shapes without extent are omitted.
  /// @param what "a box", for the note on one without triangles
  void solid(const ShapePose& location, std::string_view what, const TriangleSet& set);
  void plane(const ShapePose& location, const Eigen::Vector3d& normal, Eigen::Vector2d size);
  /// A missing submesh omits the whole mesh, with a note.
  void mesh(const ShapePose& location, const MeshFile& file, const MeshUse& use);
  /// The first polyline is the outline, others are its holes.
  void polylines(const ShapePose& location, const std::vector<Polyline>& polylines, double height,
                 const Extrude& extrude);
  void heights(const ShapePose& location, const HeightGrid& grid);

  /// Notes a shape that is not added here, or another note on a shape: "'NAME' WHAT".
  void leave_out(const ShapePose& location, std::string_view why) const;
  void note(const ShapePose& location, std::string_view what) const;

  /// All shapes [m], in the link's frame, front sides outwards: one object for each primitive, each node of a
  /// mesh, each grid, named by Place (for meshes "::node" follows) or, in files written by Canyon, with their
  /// original names. Terrain if the name has a word for it, else a building.
  [[nodiscard]] Mesh take() { return std::move(mesh_); }

 private:
  struct Soup;
  void add(const ShapePose& location, const TriangleSet& set, bool orient_it = false);
  void append(const ShapePose& location, const std::string& object, Surface surface, Soup soup,
              const Eigen::Affine3d& link_from_soup, bool orient_it);

  std::vector<std::string>& notes_;
  Mesh mesh_;
};

/// The material with this diffuse colour, as assigned in Canyon's own files; Unknown for any other.
[[nodiscard]] Material material_by_colour(const std::array<double, 3>& colour);

}  // namespace canyon::city
