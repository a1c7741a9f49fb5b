#include "canyon/analysis/heatmap/kernels/tile_terrain.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "canyon/city/city.hpp"
#include "canyon/city/mesh_topology.hpp"

namespace canyon::heatmap {
namespace {

using city::cross;
using Eigen::Vector2d;

/// Fraction of a triangle's size within which cells beyond its edges belong to it: rounding leaves no gaps.
constexpr double kSeam = 1e-9;
/// A triangle with a smaller horizontal area [m^2] is vertical.
constexpr double kUpright_m2 = 1e-12;

struct Bounds {
  Vector2d min, max;
};
template <class Triangle>
Bounds bounds_of(const Triangle& t) {
  return {t[0].template head<2>().cwiseMin(t[1].template head<2>()).cwiseMin(t[2].template head<2>()),
          t[0].template head<2>().cwiseMax(t[1].template head<2>()).cwiseMax(t[2].template head<2>())};
}

}  // namespace

TerrainHeights::TerrainHeights(const city::Mesh& mesh) {
  Bounds all{Vector2d::Constant(1e300), Vector2d::Constant(-1e300)};
  for (const city::Object& object : mesh.objects) {
    if (object.surface != city::Surface::Terrain) continue;
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
      const auto& corner = mesh.triangles[t];
      const Triangle triangle{mesh.vertices[corner[0]], mesh.vertices[corner[1]], mesh.vertices[corner[2]]};
      const Vector2d a = triangle[0].head<2>();
      if (std::abs(cross(triangle[1].head<2>() - a, triangle[2].head<2>() - a)) < kUpright_m2) continue;
      const Bounds bounds = bounds_of(triangle);
      all = {all.min.cwiseMin(bounds.min), all.max.cwiseMax(bounds.max)};
      triangles_.push_back(triangle);
    }
  }
  if (triangles_.empty()) return;

  // Bins are about as many as triangles.
  const Vector2d extent = all.max - all.min;
  corner_ = all.min;
  bin_size_m_ = std::max(std::sqrt(extent.x() * extent.y() / static_cast<double>(triangles_.size())),
                         std::max(extent.maxCoeff() / 4096, 1e-3));
  for (std::size_t k = 0; k < 2; ++k)
    bins_[k] = static_cast<std::uint32_t>(extent[static_cast<Eigen::Index>(k)] / bin_size_m_) + 1;
  const auto bins_of = [&](std::uint32_t t, const auto& call) {
    const Bounds bounds = bounds_of(triangles_[t]);
    const auto low = bin(bounds.min), high = bin(bounds.max);
    for (std::uint32_t y = low[1]; y <= high[1]; ++y)
      for (std::uint32_t x = low[0]; x <= high[0]; ++x) call(std::size_t{y} * bins_[0] + x);
  };
  in_bins_.fill(std::size_t{bins_[0]} * bins_[1], static_cast<std::uint32_t>(triangles_.size()), bins_of);
}

std::array<std::uint32_t, 2> TerrainHeights::bin(const Vector2d& point) const {
  std::array<std::uint32_t, 2> bin{};
  for (std::size_t k = 0; k < 2; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    bin[k] = static_cast<std::uint32_t>(
        std::clamp((point[i] - corner_[i]) / bin_size_m_, 0.0, static_cast<double>(bins_[k] - 1)));
  }
  return bin;
}

void TerrainHeights::heights(const Grid& grid, const Tile& tile, std::span<double> heights) const {
  assert(heights.size() == tile.cells());
  std::fill(heights.begin(), heights.end(), std::numeric_limits<double>::quiet_NaN());
  if (triangles_.empty() || heights.empty()) return;
  const auto low = bin(grid.centre(tile.first_column, tile.first_row));
  const auto high = bin(grid.centre(tile.first_column + tile.columns - 1, tile.first_row + tile.rows - 1));
  std::vector<std::uint32_t> near;
  for (std::uint32_t y = low[1]; y <= high[1]; ++y) {
    const std::size_t row = std::size_t{y} * bins_[0];
    in_bins_.append(row + low[0], row + high[0], near);
  }
  sort_unique(near);
  for (const std::uint32_t t : near) draw(triangles_[t], grid, tile, heights);
}

void TerrainHeights::draw(const Triangle& triangle, const Grid& grid, const Tile& tile,
                          std::span<double> heights) const {
  const Vector2d a = triangle[0].head<2>(), b = triangle[1].head<2>(), c = triangle[2].head<2>();
  const Bounds bounds = bounds_of(triangle);
  const Vector2d first = grid.centre(tile.first_column, tile.first_row);
  const auto range = [&](Eigen::Index k, std::uint32_t count) {
    const double low = std::ceil((bounds.min[k] - first[k]) / grid.spacing_m - 1e-6);
    const double high = std::floor((bounds.max[k] - first[k]) / grid.spacing_m + 1e-6);
    return std::array{static_cast<std::int64_t>(std::clamp(low, 0.0, static_cast<double>(count))),
                      static_cast<std::int64_t>(std::clamp(high, -1.0, count - 1.0))};
  };
  const auto columns = range(0, tile.columns), rows = range(1, tile.rows);
  const double per_area = 1 / cross(b - a, c - a);
  for (std::int64_t r = rows[0]; r <= rows[1]; ++r) {
    for (std::int64_t k = columns[0]; k <= columns[1]; ++k) {
      const Vector2d p = grid.centre(tile.first_column + static_cast<std::uint32_t>(k),
                                     tile.first_row + static_cast<std::uint32_t>(r));
      // Barycentric coordinates.
      const double from_b = cross(p - a, c - a) * per_area;
      const double weight_c = cross(b - a, p - a) * per_area;
      if (from_b < -kSeam || weight_c < -kSeam || from_b + weight_c > 1 + kSeam) continue;
      const double z = triangle[0].z() + from_b * (triangle[1].z() - triangle[0].z()) +
                       weight_c * (triangle[2].z() - triangle[0].z());
      double& height = heights[static_cast<std::size_t>(r) * tile.columns + static_cast<std::size_t>(k)];
      if (!(height >= z)) height = z;  // NaN as well
    }
  }
}

}  // namespace canyon::heatmap
