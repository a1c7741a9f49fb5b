#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "canyon/city/fwd.hpp"
#include "canyon/paths/propagation/index/bounds_blocks.hpp"

namespace canyon::propagation {

/// A maximal group of adjacent triangles of one mesh in one plane, fronts to the same side: one mirror.
struct Facet {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, to the front
  double offset = 0;                                  ///< normal . x = offset on the plane
  double deviation = 0;                               ///< of the farthest vertex from the plane [m]
  Eigen::Vector3d min, max;                           ///< bounds
  std::uint32_t first = 0, count = 0;                 ///< of FacetSet's flat triangles
  std::uint32_t first_bounds = 0;                     ///< of the bounds of blocks of these
  std::uint32_t first_wide_bounds = 0;                ///< of the bounds of blocks of those
  int axis = 2;                                       ///< omitted in flat triangles
};

/// Facets within reach that may face the antennas around a point. Structure of arrays.
struct NearFacets {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius_m = -1;              ///< of the antennas around the centre; negative: none
  std::vector<std::uint32_t> facet;  ///< index into the set
  std::vector<double> normal_x, normal_y, normal_z, offset, deviation;
  std::vector<double> min_x, min_y, min_z, max_x, max_y, max_z;
};

/// Facets in front of an antenna and within reach, prepared for testing many directions at once: structure of
/// arrays in floats relative to the antenna, so that distances are small numbers. Bounds are widened by 2 mm
/// plus 1e-6 of the coordinates, which covers the roundings to float. Facets with their back to the antenna
/// may be included; their bounds match nothing.
struct FacingFacets {
  std::vector<std::uint32_t> facet;  ///< index into the set; not padded
  std::vector<float> normal_x, normal_y, normal_z, height;
  std::vector<float> min_x, min_y, min_z, max_x, max_y, max_z;
  /// All arrays except `facet` are padded to a multiple of this with facets that match nothing.
  static constexpr std::size_t kLanes = 32;

  /// Adds the facets of `near` whose front faces the antenna from more than `clearance_m` + twice their
  /// deviation above their plane. @param antenna within `near.radius_m` of its centre
  void fill(const NearFacets& near, const Eigen::Vector3d& antenna, double clearance_m);
};

/// Marks facets that may reflect a satellite in direction `s` to the antenna: the reflection point of the
/// image construction is within the facet's bounds, cos(incidence) is at least `min_cosine` and the leg from
/// the antenna at most `reach_m`. Never misses one; `marks` has the padded length.
void mark_reflecting(const FacingFacets& facing, const Eigen::Vector3d& s, double min_cosine, double reach_m,
                     std::vector<std::uint8_t>& marks);

/// The facets of a mesh, built once. Foliage does not reflect; terrain only with `with_terrain`. Const
/// members are thread-safe.
class FacetSet {
 public:
  /// Facets [i * kBlock, (i + 1) * kBlock) are close together; the last block may be shorter.
  static constexpr std::size_t kBlock = BoundsBlocks::kBlock;

  /// No facets.
  FacetSet() = default;
  /// Triangles belong to one facet if they share an edge (same two positions), their normals differ by less
  /// than 0.5 deg and no vertex is farther than 0.5 mm from the plane of the group's largest triangle: the
  /// roundings of meshes stored in floats are smaller.
  FacetSet(const city::Mesh& mesh, bool with_terrain);

  [[nodiscard]] const std::vector<Facet>& facets() const { return facets_; }

  /// Facets that may face an antenna within `radius_m` of a point, and have bounds within `reach_m` of it.
  void gather(const Eigen::Vector3d& centre, double radius_m, double reach_m, NearFacets& out) const;

  /// The triangle of the mesh at a point of the facet's plane, the lowest number of several; edges belong to
  /// the facet (1 nm of slack).
  [[nodiscard]] std::optional<std::uint32_t> triangle_at(const Facet& facet,
                                                         const Eigen::Vector3d& point) const;

  /// Corners [m, frame of the mesh] of a convex polygon on the facet's plane that its triangles cover without
  /// a gap, counter-clockwise about its normal: the facet's largest triangle, or the largest convex
  /// quadrilateral of it and a neighbour, which covers a whole wall of two triangles. @return 3 or 4 corners
  std::size_t convex_part(const Facet& facet, std::array<Eigen::Vector3d, 4>& corners) const;

 private:
  /// A triangle on two of the three axes, counter-clockwise there.
  struct FlatTriangle {
    std::array<Eigen::Vector2d, 3> corner;
    std::uint32_t triangle = 0;
  };
  static constexpr std::uint32_t kFlatBlock = 16;  ///< flat triangles in a block, blocks in a wide one
  void find_facets(const city::Mesh& mesh, bool with_terrain);
  void add_facet(const city::Mesh& mesh, std::vector<std::uint32_t>& group);
  void order_in_blocks();

  std::vector<Facet> facets_;
  std::vector<FlatTriangle> flat_;
  /// Bounds of each block of a facet's flat triangles, from Facet::first_bounds, and of each wide block, for
  /// facets that have several.
  std::vector<Eigen::AlignedBox2d> flat_bounds_, wide_bounds_;
  BoundsBlocks blocks_;  ///< of the facets
};

}  // namespace canyon::propagation
