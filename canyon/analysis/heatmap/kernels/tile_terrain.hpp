#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "canyon/analysis/heatmap/kernels/bins.hpp"
#include "canyon/analysis/heatmap/kernels/grid.hpp"
#include "canyon/city/fwd.hpp"

namespace canyon::heatmap {

/// Heights of a city's terrain under whole tiles, by rasterising its triangles instead of casting a ray for
/// each cell. Const, thread-safe after construction.
class TerrainHeights {
 public:
  /// @param mesh valid by city::check_mesh(); the needed parts are copied
  explicit TerrainHeights(const city::Mesh& mesh);

  /// True if the city has no terrain.
  [[nodiscard]] bool empty() const { return triangles_.empty(); }
  /// heights[i]: ENU z of the highest terrain sheet at the centre of the tile's cell i, NaN if there is none.
  /// Same result as RayScene::terrain_height(), but terrain extends 1e-9 of a triangle's size beyond an outer
  /// edge. Linear over a triangle: exact to 1e-9 m for triangles up to 10 km.
  void heights(const Grid& grid, const Tile& tile, std::span<double> heights) const;

 private:
  using Triangle = std::array<Eigen::Vector3d, 3>;
  void draw(const Triangle& triangle, const Grid& grid, const Tile& tile, std::span<double> heights) const;
  [[nodiscard]] std::array<std::uint32_t, 2> bin(const Eigen::Vector2d& point) const;

  std::vector<Triangle> triangles_;
  // A regular grid of bins over the terrain.
  Eigen::Vector2d corner_ = Eigen::Vector2d::Zero();
  double bin_size_m_ = 1;
  std::array<std::uint32_t, 2> bins_{1, 1};
  Bins in_bins_;  ///< triangles
};

}  // namespace canyon::heatmap
