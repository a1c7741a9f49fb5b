#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "canyon/city/city.hpp"

namespace canyon::heatmap {

/// A part of a mesh that encloses space: a line that goes in comes out again through a front side.
struct Solid {
  city::Box bounds;
  /// It has no floor: its boundary lies in the horizontal plane of its lowest vertex.
  bool floorless = false;
};

/// Which triangles bound solids.
struct Solids {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> of_triangle;  ///< one per triangle: index into `solids`, or kNone
  std::vector<Solid> solids;
};

/// Finds the solids of a mesh: connected parts of one object (vertices of equal position are one)
///  - that are closed: along every edge as many triangles run one way as the other. The floor may be missing:
///    edges of other counts lie within 1e-6 m of the horizontal plane of the part's lowest vertex;
///  - whose triangles do not cross or touch one another except where they share vertices, or in their plane;
///  - whose winding number is nowhere negative (in front of each triangle it is counted along a ray).
/// On such a part a half-line that rises meets a front side from behind if it meets any triangle at all and
/// did not start under a missing floor: the winding number falls to 0 at infinity, only such a crossing
/// lowers it, and none but it is left where the half-line begins inside. So the triangles whose front looks
/// towards a satellite suffice for its shadow. All other parts, and parts of more than 4,096 triangles, are
/// not treated as solids; that costs time and does not change the answer.
/// @param mesh as city::check_mesh() demands
[[nodiscard]] Solids find_solids(const city::Mesh& mesh);

}  // namespace canyon::heatmap
