#include "canyon/heatmap/kernels/shadows.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

#include "canyon/heatmap/kernels/shadow_raster.hpp"
#include "canyon/heatmap/kernels/shadow_solids.hpp"
#include "canyon/heatmap/kernels/shadow_tree.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kLeastRise = 0.01;

[[maybe_unused]] bool is_plane(const CellPlane& plane) {
  return plane.first.allFinite() && plane.spacing_m > 0 && std::isfinite(plane.spacing_m) &&
         std::isfinite(plane.z) && plane.columns < 1U << 29 && plane.rows < 1U << 29;
}

[[maybe_unused]] bool is_direction(const Vector3d& direction) {
  return std::abs(direction.squaredNorm() - 1) < 1e-6 && direction.z() > kLeastRise;
}

Window whole(const CellPlane& plane) {
  return {0, static_cast<int>(plane.columns) - 1, 0, static_cast<int>(plane.rows) - 1};
}

/// The projection of the city to the cells of a plane along a direction.
class Projection {
 public:
  Projection(const CellPlane& plane, const Vector3d& direction)
      : first_(plane.first),
        z_(plane.z),
        cells_per_metre_(1 / plane.spacing_m),
        shear_(direction.head<2>() / direction.z()),
        range_per_metre_(1 / direction.z()) {}

  /// `height` of the point above the plane; negative below.
  [[nodiscard]] RasterPoint operator()(const std::array<double, 3>& point, double height) const {
    return {(point[0] - first_.x() - height * shear_.x()) * cells_per_metre_,
            (point[1] - first_.y() - height * shear_.y()) * cells_per_metre_, height * range_per_metre_};
  }
  [[nodiscard]] ShadowReach reach(const CellPlane& plane, double max_range_m) const {
    const Vector2d extent((plane.columns - 1) * plane.spacing_m, (plane.rows - 1) * plane.spacing_m);
    return {first_, first_ + extent, z_, shear_, max_range_m / range_per_metre_};
  }

 private:
  Vector2d first_;
  double z_, cells_per_metre_;
  Vector2d shear_;
  double range_per_metre_;
};

/// Where a side leaves the plane; `above` and `below` are its ends. Both triangles that share the side get
/// the same point.
RasterPoint cut(const RasterPoint& above, const RasterPoint& below) {
  const double share = above.range / (above.range - below.range);
  return {above.u + share * (below.u - above.u), above.v + share * (below.v - above.v), 0};
}

/// Draws the part of a triangle above the plane (range 0): a triangle or two.
template <class Raster>
void add_above(const std::array<RasterPoint, 3>& corner, const Window& window, Raster& raster) {
  const int above = (corner[0].range > 0) + (corner[1].range > 0) + (corner[2].range > 0);
  if (above == 3) {
    raster.add(corner[0], corner[1], corner[2], window);
    return;
  }
  // Turns the triangle so that its first corner is alone on its side of the plane.
  const bool alone = above == 1;
  const std::size_t k = (corner[0].range > 0) == alone ? 0 : (corner[1].range > 0) == alone ? 1 : 2;
  const RasterPoint& a = corner[k];
  const RasterPoint& b = corner[(k + 1) % 3];
  const RasterPoint& c = corner[(k + 2) % 3];
  if (alone) {
    raster.add(a, cut(a, b), cut(a, c), window);
  } else {
    const RasterPoint on_b = cut(b, a), on_c = cut(c, a);
    raster.add(b, c, on_b, window);
    raster.add(c, on_c, on_b, window);
  }
}

}  // namespace

struct ShadowCaster::Impl {
  struct Triangle {
    std::array<std::array<double, 3>, 3> corner;
    std::uint32_t solid;
  };
  std::vector<Triangle> triangles;  ///< in the tree's order
  std::vector<Solid> solids;
  ShadowTree tree;

  explicit Impl(const city::Mesh& mesh) : tree(mesh) {
    Solids found = find_solids(mesh);
    solids = std::move(found.solids);
    triangles.reserve(mesh.triangles.size());
    for (const std::uint32_t t : tree.order()) {
      Triangle triangle;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector3d& v = mesh.vertices[mesh.triangles[t][k]];
        triangle.corner[k] = {v.x(), v.y(), v.z()};
      }
      triangle.solid = found.of_triangle[t];
      triangles.push_back(triangle);
    }
  }

  /// Calls draw(triangle, its corners in cells, twice its area in cells) for the triangles that reach above
  /// the plane and may cover the tile.
  template <class Draw>
  void project(const CellPlane& plane, const Vector3d& direction, double max_range_m, Draw&& draw) const {
    const Projection projection(plane, direction);
    tree.visit(projection.reach(plane, max_range_m), [&](std::uint32_t first, std::uint32_t count) {
      for (std::uint32_t i = first; i < first + count; ++i) {
        const Triangle& triangle = triangles[i];
        std::array<RasterPoint, 3> corner;
        bool above = false;
        for (std::size_t k = 0; k < 3; ++k) {
          const double height = triangle.corner[k][2] - plane.z;
          above |= height > 0;
          corner[k] = projection(triangle.corner[k], height);
        }
        if (!above) continue;
        const double twice_area = (corner[1].u - corner[0].u) * (corner[2].v - corner[0].v) -
                                  (corner[2].u - corner[0].u) * (corner[1].v - corner[0].v);
        draw(triangle, corner, twice_area);
      }
    });
  }

  /// Cells that may lie within a solid.
  [[nodiscard]] static Window footprint(const Solid& solid, const CellPlane& plane) {
    const auto column = [&](double x) {
      return std::clamp((x - plane.first.x()) / plane.spacing_m, -2.0, plane.columns + 1.0);
    };
    const auto row = [&](double y) {
      return std::clamp((y - plane.first.y()) / plane.spacing_m, -2.0, plane.rows + 1.0);
    };
    const Window all = whole(plane);
    return {std::max(all.first_column, floor_of(column(solid.bounds.min.x()))),
            std::min(all.last_column, ceil_of(column(solid.bounds.max.x()))),
            std::max(all.first_row, floor_of(row(solid.bounds.min.y()))),
            std::min(all.last_row, ceil_of(row(solid.bounds.max.y())))};
  }
};

ShadowCaster::ShadowCaster(const city::Mesh& mesh) {
  city::check_mesh(mesh, "city");
  impl_ = std::make_unique<Impl>(mesh);
}
ShadowCaster::~ShadowCaster() = default;
ShadowCaster::ShadowCaster(ShadowCaster&&) noexcept = default;

void ShadowCaster::shadows(const CellPlane& plane, const Vector3d& direction,
                           std::span<std::uint8_t> blocked) const {
  assert(is_plane(plane) && is_direction(direction));
  assert(blocked.size() == std::size_t{plane.columns} * plane.rows);
  if (blocked.empty()) return;
  static thread_local BitRaster raster;  // keeps its memory from tile to tile
  raster.reset(plane.columns, plane.rows);
  const Window window = whole(plane);
  impl_->project(
      plane, direction, std::numeric_limits<double>::infinity(),
      [&](const Impl::Triangle& triangle, const std::array<RasterPoint, 3>& corner, double twice_area) {
        // The projection turns fronts that look away from the satellite over.
        if (twice_area == 0 || (triangle.solid != Solids::kNone && twice_area < 0)) return;
        add_above(corner, window, raster);
      });
  raster.expand(blocked);
}

void ShadowCaster::ranges(const CellPlane& plane, const Vector3d& direction, double max_range_m,
                          std::span<float> ranges) const {
  assert(is_plane(plane) && is_direction(direction) && max_range_m >= 0);
  assert(ranges.size() == std::size_t{plane.columns} * plane.rows);
  RangeRaster raster(ranges, plane.columns);
  if (ranges.empty()) return;
  const Window window = whole(plane);
  impl_->project(
      plane, direction, max_range_m,
      [&](const Impl::Triangle& triangle, const std::array<RasterPoint, 3>& corner, double twice_area) {
        if (twice_area == 0) return;
        const double nearest = std::min(std::min(corner[0].range, corner[1].range), corner[2].range);
        if (nearest > max_range_m) return;
        if (twice_area > 0 && triangle.solid != Solids::kNone) {
          // Rays meet a back side first only from within the solid or through its missing floor.
          const Solid& solid = impl_->solids[triangle.solid];
          if (solid.bounds.min.z() <= plane.z) {
            add_above(corner, Impl::footprint(solid, plane), raster);
            return;
          }
          if (!solid.floorless) return;
        }
        add_above(corner, window, raster);
      });
  const auto farthest = static_cast<float>(max_range_m);
  for (float& range : ranges) {
    range = range > farthest ? std::numeric_limits<float>::infinity() : range;
  }
}

}  // namespace canyon::heatmap
