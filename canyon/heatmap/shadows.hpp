#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "canyon/city/city.hpp"

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
/// linear over it, so that a cell's answer is exact where its centre is (rounding: cells within 1e-9 of the
/// coordinates of a projected edge, as RayScene's within surface_offset_m(), may fall to either side).
/// Static cities only. Const, thread-safe after construction.
class ShadowCaster {
 public:
  explicit ShadowCaster(const city::Mesh& mesh);
  ~ShadowCaster();
  ShadowCaster(ShadowCaster&&) noexcept;

  /// blocked[i] = 1 where anything lies from cell i towards `direction` (unit, ENU, z > 0.01), else 0. Same
  /// answers as RayScene::occluded() from the cells' centres.
  void shadows(const CellPlane& plane, const Eigen::Vector3d& direction,
               std::span<std::uint8_t> blocked) const;

  /// ranges[i]: from cell i along `direction` to what is met first within max_range_m, infinite where nothing
  /// is. Same answers as RayScene::cast(). Within 1e-4 m.
  void ranges(const CellPlane& plane, const Eigen::Vector3d& direction, double max_range_m,
              std::span<float> ranges) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::heatmap
