#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <vector>

#include "canyon/city/fwd.hpp"

namespace canyon::propagation {

/// Part of a ray, ranges [m] from its origin.
struct RangeInterval {
  double from_m = 0;
  double to_m = 0;
};

/// Length [m] of the union of the intervals. Sorts them.
[[nodiscard]] double covered_length_m(std::vector<RangeInterval>& intervals);

/// The vegetation of a mesh (Surface::Foliage) as volumes: one for each group of triangles of one object that
/// are connected by the positions of their vertices. Built once; const members are thread-safe.
class FoliageVolumes {
 public:
  /// No volumes.
  FoliageVolumes() = default;
  /// The mesh must pass city::check_mesh().
  explicit FoliageVolumes(const city::Mesh& mesh);

  [[nodiscard]] bool empty() const { return volumes_.empty(); }

  /// Appends the intervals in which a ray (frame of the mesh, unit direction) is inside a volume, one for
  /// each passage: from a front to the next back of the same surface. If the ray only leaves a closed
  /// surface, its origin is inside and the interval begins there. A closed surface with inward fronts is
  /// flipped. An open sheet, a card of leaves, has no thickness in a mesh: it gives no interval unless the
  /// ray enters by a front and leaves by a back of the same one (a crown without a floor). Intersections are
  /// computed in doubles. Crossings within 1 um of each other count as one point, so that rays through edges
  /// and vertices count once and grazing ones do not count.
  void append_inside(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                     std::vector<RangeInterval>& intervals) const;

 private:
  struct Volume {
    Eigen::AlignedBox3d bounds;
    std::size_t first = 0, count = 0;  ///< of triangles_
    bool closed = false;
  };
  static constexpr std::size_t kBlock = 16;  ///< triangles, and volumes, that share bounds

  std::vector<std::array<Eigen::Vector3d, 3>> triangles_;  ///< by volume
  std::vector<Eigen::AlignedBox3d> triangle_blocks_;       ///< kBlock each, across volumes
  std::vector<Volume> volumes_;
  std::vector<Eigen::AlignedBox3d> volume_blocks_;
};

}  // namespace canyon::propagation
