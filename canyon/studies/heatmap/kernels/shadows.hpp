#pragma once

#include <Eigen/Core>
#include <cstddef>
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

/// Lines of sight of whole tiles without rays: the triangles above a plane, projected along a direction onto
/// it, are drawn cell by cell. The projection of a triangle is a triangle, and the range along the ray is
/// linear over it, so that a cell's answer is exact where its centre is. In doubles: cells within 1e-9 of
/// their spacing (and 1e-15 of the coordinates) of a projected edge may fall to either side. RayScene, in
/// floats, may differ within its surface_offset_m(); over Hong Kong it was 1e-6 m and less. Cells in solids
/// are blocked and ranged as rays from there are. A triangle seen exactly from its edge is not met. Static
/// cities only. Const, thread-safe after construction; the steady state allocates nothing.
/// docs/heatmap.md says how it works.
class ShadowCaster {
 public:
  /// Copies what it needs of the mesh (about 110 bytes a triangle). Throws InputError as city::check_mesh()
  /// does; an empty mesh is an open field.
  explicit ShadowCaster(const city::Mesh& mesh);
  ~ShadowCaster();
  ShadowCaster(ShadowCaster&&) noexcept;

  /// blocked[i] = 1 where anything lies from cell i towards `direction`, else 0. Same answers as
  /// RayScene::occluded() from the cells' centres.
  /// @param direction unit, ENU, z > 0.01, that is 0.6 degrees above the horizon (asserted)
  /// @param blocked one for each cell (asserted)
  void shadows(const CellPlane& plane, const Eigen::Vector3d& direction,
               std::span<std::uint8_t> blocked) const;

  /// ranges[i]: from cell i along `direction` [m] to what is met first within max_range_m, infinite where
  /// nothing is. Same answers as RayScene::cast(), within 1e-4 m (where a triangle is grazed, whose range
  /// RayScene has from floats); within 1e-6 m of exact and the rounding to a float, 6e-8 of the range.
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
