#include "canyon/analysis/heatmap/kernels/shadows.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>

#include "canyon/analysis/heatmap/kernels/shadow_raster.hpp"
#include "canyon/city/city.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMinRise = 0.01;

[[maybe_unused]] bool is_plane(const CellPlane& plane) {
  return plane.first.allFinite() && plane.spacing_m > 0 && std::isfinite(plane.spacing_m) &&
         std::isfinite(plane.z) && plane.columns < 1U << 29 && plane.rows < 1U << 29;
}

[[maybe_unused]] bool is_direction(const Vector3d& direction) {
  return std::abs(direction.squaredNorm() - 1) < 1e-6 && direction.z() > kMinRise;
}

/// The space from which objects throw a shadow onto a rectangle of a horizontal plane: points p above it, up
/// to `highest`, whose projection along the direction, p - (p.z - z) shear, is in the rectangle.
struct ShadowReach {
  Vector2d min, max;   ///< of the rectangle
  double z = 0;        ///< of the plane
  Vector2d shear;      ///< horizontal distance per metre of height, direction.xy / direction.z
  double highest = 0;  ///< above the plane; may be infinite

  /// Whether a box may throw a shadow. Exact by the separating axes of a rectangle and a box swept along the
  /// shear; true if rounding on the edges leaves it undecided.
  [[nodiscard]] bool meets(const Vector3d& low, const Vector3d& high) const {
    const double top = std::min(high.z() - z, highest), base = std::max(low.z() - z, 0.0);
    if (!(high.z() > z) || base > highest) return false;
    constexpr double kSlack_m = 1e-6;
    for (int k = 0; k < 2; ++k) {
      const double a = shear[k] * base, b = shear[k] * top;
      if (low[k] - std::max(a, b) > max[k] + kSlack_m || high[k] - std::min(a, b) < min[k] - kSlack_m)
        return false;
    }
    const double away = shear.x() * (0.5 * (low.y() + high.y()) - 0.5 * (min.y() + max.y())) -
                        shear.y() * (0.5 * (low.x() + high.x()) - 0.5 * (min.x() + max.x()));
    const double half_x = 0.5 * (high.x() - low.x() + max.x() - min.x()) + kSlack_m;
    const double half_y = 0.5 * (high.y() - low.y() + max.y() - min.y()) + kSlack_m;
    return std::abs(away) <= std::abs(shear.x()) * half_y + std::abs(shear.y()) * half_x;
  }
};

/// A tree of bounding boxes of a mesh's triangles (split at the median of the longest side), to find those
/// that throw a shadow onto a tile without testing all.
class ShadowTree {
 public:
  explicit ShadowTree(const city::Mesh& mesh) : order_(mesh.triangles.size()) {
    std::iota(order_.begin(), order_.end(), 0U);
    if (order_.empty()) return;
    std::vector<Vector3d> low, high;
    low.reserve(order_.size());
    high.reserve(order_.size());
    for (const auto& t : mesh.triangles) {
      const Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
      low.emplace_back(a.cwiseMin(b).cwiseMin(c));
      high.emplace_back(a.cwiseMax(b).cwiseMax(c));
    }
    struct Task {
      std::uint32_t node, first, count;
    };
    std::vector<Task> tasks{{0, 0, static_cast<std::uint32_t>(order_.size())}};
    nodes_.resize(1);
    while (!tasks.empty()) {
      const Task task = tasks.back();
      tasks.pop_back();
      Vector3d min = Vector3d::Constant(1e300), max = -min;
      for (std::uint32_t i = task.first; i < task.first + task.count; ++i) {
        min = min.cwiseMin(low[order_[i]]);
        max = max.cwiseMax(high[order_[i]]);
      }
      nodes_[task.node].min = min;
      nodes_[task.node].max = max;
      if (task.count <= kLeafTriangles) {
        nodes_[task.node].first = task.first;
        nodes_[task.node].count = task.count;
        continue;
      }
      int axis = 0;
      (max - min).maxCoeff(&axis);
      const std::uint32_t half = task.count / 2;
      const auto begin = order_.begin() + task.first;
      std::nth_element(begin, begin + half, begin + task.count, [&](std::uint32_t a, std::uint32_t b) {
        const double at_a = low[a][axis] + high[a][axis], at_b = low[b][axis] + high[b][axis];
        return at_a != at_b ? at_a < at_b : a < b;
      });
      const auto child = static_cast<std::uint32_t>(nodes_.size());
      nodes_.resize(nodes_.size() + 2);
      nodes_[task.node].first = child;
      nodes_[task.node].count = 0;
      tasks.push_back({child, task.first, half});
      tasks.push_back({child + 1, task.first + half, task.count - half});
    }
  }

  /// The triangles in the order of visit().
  [[nodiscard]] const std::vector<std::uint32_t>& order() const { return order_; }

  /// Calls leaf(first, count) for runs of order() that contain every triangle in reach.
  template <class Leaf>
  void visit(const ShadowReach& reach, Leaf&& leaf) const {
    if (nodes_.empty()) return;
    std::array<std::uint32_t, kDeepest> stack;
    std::size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
      const Node& node = nodes_[stack[--depth]];
      if (!reach.meets(node.min, node.max)) continue;
      if (node.count > 0) {
        leaf(node.first, node.count);
      } else {
        stack[depth++] = node.first + 1;
        stack[depth++] = node.first;
      }
    }
  }

 private:
  static constexpr std::uint32_t kLeafTriangles = 8;
  /// Halving 2^32 triangles takes 32 steps, each of which leaves one node pending.
  static constexpr std::size_t kDeepest = 64;
  struct Node {
    Vector3d min, max;
    std::uint32_t first = 0;  ///< of a leaf: triangle in order(); else: node, the other child follows it
    std::uint32_t count = 0;  ///< of a leaf; 0: not a leaf
  };
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
};

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

/// The point where a side with these ends crosses the plane. Both triangles of the side get the same point.
RasterPoint cut(const RasterPoint& above, const RasterPoint& below) {
  const double fraction = above.range / (above.range - below.range);
  return {above.u + fraction * (below.u - above.u), above.v + fraction * (below.v - above.v), 0};
}

/// Rasterises the part of a triangle above the plane (range 0): a triangle or two.
template <class Raster>
void add_above(const std::array<RasterPoint, 3>& corner, Raster& raster) {
  const int above = (corner[0].range > 0) + (corner[1].range > 0) + (corner[2].range > 0);
  if (above == 3) {
    raster.add(corner[0], corner[1], corner[2]);
    return;
  }
  // Permutes the corners so that the first one is alone on its side of the plane.
  const bool alone = above == 1;
  const std::size_t k = (corner[0].range > 0) == alone ? 0 : (corner[1].range > 0) == alone ? 1 : 2;
  const RasterPoint& a = corner[k];
  const RasterPoint& b = corner[(k + 1) % 3];
  const RasterPoint& c = corner[(k + 2) % 3];
  if (alone) {
    raster.add(a, cut(a, b), cut(a, c));
  } else {
    const RasterPoint on_b = cut(b, a), on_c = cut(c, a);
    raster.add(b, c, on_b);
    raster.add(c, on_c, on_b);
  }
}

}  // namespace

struct ShadowCaster::Impl {
  using Triangle = std::array<std::array<double, 3>, 3>;
  std::vector<Triangle> triangles;  ///< in the tree's order
  ShadowTree tree;

  explicit Impl(const city::Mesh& mesh) : tree(mesh) {
    triangles.reserve(mesh.triangles.size());
    for (const std::uint32_t t : tree.order()) {
      Triangle triangle;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector3d& v = mesh.vertices[mesh.triangles[t][k]];
        triangle[k] = {v.x(), v.y(), v.z()};
      }
      triangles.push_back(triangle);
    }
  }

  /// Calls draw(corners in cells) for the triangles that extend above the plane, may cover the tile, and are
  /// not seen exactly edge-on.
  template <class DrawFunction>
  void project(const CellPlane& plane, const Vector3d& direction, double max_range_m,
               DrawFunction&& draw) const {
    const Projection projection(plane, direction);
    tree.visit(projection.reach(plane, max_range_m), [&](std::uint32_t first, std::uint32_t count) {
      for (std::uint32_t i = first; i < first + count; ++i) {
        std::array<RasterPoint, 3> corner;
        bool above = false;
        for (std::size_t k = 0; k < 3; ++k) {
          const double height = triangles[i][k][2] - plane.z;
          above |= height > 0;
          corner[k] = projection(triangles[i][k], height);
        }
        if (!above) continue;
        const double twice_area = (corner[1].u - corner[0].u) * (corner[2].v - corner[0].v) -
                                  (corner[2].u - corner[0].u) * (corner[1].v - corner[0].v);
        if (twice_area != 0) draw(corner);
      }
    });
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
  static thread_local BitRaster raster;  // static to reuse its memory from tile to tile
  raster.reset(plane.columns, plane.rows);
  impl_->project(plane, direction, std::numeric_limits<double>::infinity(),
                 [&](const std::array<RasterPoint, 3>& corner) { add_above(corner, raster); });
  raster.expand(blocked);
}

void ShadowCaster::ranges(const CellPlane& plane, const Vector3d& direction, double max_range_m,
                          std::span<float> ranges) const {
  assert(is_plane(plane) && is_direction(direction) && max_range_m >= 0);
  assert(ranges.size() == std::size_t{plane.columns} * plane.rows);
  RangeRaster raster(ranges, plane.columns);
  if (ranges.empty()) return;
  impl_->project(plane, direction, max_range_m, [&](const std::array<RasterPoint, 3>& corner) {
    const double nearest = std::min(std::min(corner[0].range, corner[1].range), corner[2].range);
    if (nearest <= max_range_m) add_above(corner, raster);
  });
  const auto farthest = static_cast<float>(max_range_m);
  for (float& range : ranges) range = range > farthest ? std::numeric_limits<float>::infinity() : range;
}

}  // namespace canyon::heatmap
