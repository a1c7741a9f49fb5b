#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/read_report.hpp"
#include "canyon/city/fwd.hpp"

namespace canyon::city {

/// A range of triangles that belong together: a building, the terrain, a tree.
struct Object {
  std::string name;
  Surface surface = Surface::Building;
  std::uint32_t first_triangle = 0;
  std::uint32_t triangle_count = 0;
  /// The mix from which a building's facade is sampled, by its tags in a map. ByBuilding: no such tags.
  FacadeMix facades = FacadeMix::ByBuilding;
};

/// A triangle mesh in a local frame [m], z up; counter-clockwise triangles seen from their front (outside).
struct Mesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Material> materials;  ///< one per triangle
  std::vector<Object> objects;      ///< cover all triangles, in order, without overlap

  [[nodiscard]] Surface surface_of(std::uint32_t triangle) const;
};

/// Bounds of a mesh; min > max for an empty one.
struct Box {
  Eigen::Vector3d min = Eigen::Vector3d::Constant(1e300);
  Eigen::Vector3d max = Eigen::Vector3d::Constant(-1e300);
};

/// A city: static surfaces in the ENU frame about an origin. Immutable once built, shared by later modules.
struct City {
  std::string name;
  geodesy::LocalFrame frame;  ///< ENU: heading 0 (an import's heading is applied to the vertices)
  Mesh mesh;
  ReadReport notes;  ///< parts omitted, guessed or repaired on import
  /// Ellipsoidal height of mean sea level in the city [m]; 0 if nothing is known of it.
  double geoid_undulation_m = 0;
  /// Seed of facade properties that are sampled besides materials (propagation::Propagator).
  std::uint64_t seed = 0;

  [[nodiscard]] Box bounds() const;
};

/// Throws InputError if an index is out of range, a vertex is not finite or farther than 1,000 km from the
/// origin, arrays differ in length or objects do not cover the triangles. `name` is used in the message.
void check_mesh(const Mesh& mesh, const std::string& name);

/// Adds triangles as one object. Degenerate triangles (area below 1e-8 m^2, i.e. below what rays can hit) are
/// dropped with the vertices that only they use; returns their number. No object is added if no triangle is
/// left. Throws InputError for an index out of range.
std::size_t append_object(Mesh& mesh, std::string name, Surface surface, Material material,
                          const std::vector<Eigen::Vector3d>& vertices,
                          const std::vector<std::array<std::uint32_t, 3>>& triangles);

/// Notes the number of triangles dropped by append_object() and readers; nothing for none.
void note_degenerate(ReadReport& notes, std::size_t dropped);

struct CitySummary {
  std::size_t buildings = 0;  ///< objects with Surface::Building
  std::size_t triangles = 0;
  std::size_t terrain_triangles = 0;
  Box bounds;
  double highest_roof_m = 0;
  double built_area_fraction = 0;  ///< fraction of the buildings' bounds (in plan) under roofs, sampled
};
[[nodiscard]] CitySummary summarize(const City& city);

}  // namespace canyon::city
