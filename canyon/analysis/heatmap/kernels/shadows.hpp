#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>

#include "canyon/city/fwd.hpp"

namespace canyon::heatmap {

/// Cells of one tile in a horizontal plane: cell (c, r) at (first.x + c spacing, first.y + r spacing, z),
/// index r columns + c.
struct CellPlane {
  Eigen::Vector2d first = Eigen::Vector2d::Zero();  ///< centre of the south-western cell
  double spacing_m = 1;
  std::uint32_t columns = 0, rows = 0;
  double z = 0;
};

/// Lines of sight of whole tiles without rays: the triangles above a plane are projected along a direction
/// onto it and rasterised. The projection of a triangle is a triangle, and the range along the ray is linear
/// over it, so that a cell's value is exact at its centre. In doubles: cells within 1e-9 of their spacing
/// (and 1e-15 of the coordinates) of a projected edge may be on either side. RayScene, in floats, may differ
/// within its surface_offset_m(); over Hong Kong it was 1e-6 m and less. For cells in solids, blockage and
/// ranges are those of rays that start there. A triangle seen exactly edge-on is not hit. Static cities only.
/// Const, thread-safe after construction; does not allocate in steady state. docs/heatmap.md describes the
/// method.
class ShadowCaster {
 public:
  /// Copies the needed parts of the mesh (about 110 bytes a triangle). Throws InputError as
  /// city::check_mesh(); an empty mesh is an open field.
  explicit ShadowCaster(const city::Mesh& mesh);
  ~ShadowCaster();
  ShadowCaster(ShadowCaster&&) noexcept;

  /// blocked[i] = 1 if there is a triangle from cell i towards `direction`, else 0. Same result as
  /// RayScene::occluded() from the cells' centres.
  /// @param direction unit, ENU, z > 0.01, that is 0.6 degrees above the horizon (asserted)
  /// @param blocked one for each cell (asserted)
  void shadows(const CellPlane& plane, const Eigen::Vector3d& direction,
               std::span<std::uint8_t> blocked) const;

  /// ranges[i]: distance from cell i along `direction` [m] to the first hit within max_range_m, infinite if
  /// there is none. Same result as RayScene::cast(), within 1e-4 m (for grazed triangles, whose range
  /// RayScene computes in floats); within 1e-6 m of exact and the rounding to a float, 6e-8 of the range.
  /// @param direction unit, ENU, z > 0.01 (asserted)
  /// @param max_range_m not negative (asserted); may be infinite. A near limit saves time
  /// @param ranges one for each cell (asserted)
  void ranges(const CellPlane& plane, const Eigen::Vector3d& direction, double max_range_m,
              std::span<float> ranges) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::heatmap
