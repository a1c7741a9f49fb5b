#include "canyon/analysis/heatmap/kernels/tile_interior.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"

namespace canyon::heatmap {
namespace {

using Point = std::array<double, 3>;
using raytrace::kLevelRays;

constexpr std::size_t kBands = 1024;
/// With more visible ends per cell, the rays of containment() cost less (about 20 us a cell).
constexpr std::size_t kMaxEnds = 400;

/// The intersection of the edge from `a` to `b` with the plane; bit-identical for both orders of the ends.
std::array<double, 2> cut(const Point& a, const Point& b, double z) {
  const Point &low = a < b ? a : b, &high = a < b ? b : a;
  const double fraction = (z - low[2]) / (high[2] - low[2]);
  return {low[0] + fraction * (high[0] - low[0]), low[1] + fraction * (high[1] - low[1])};
}

bool is_above(const Point& point, double z) {
  return point[2] > z;
}

/// Surfaces whose normal has a smaller horizontal part are not followed to their intersection with the plane.
constexpr double kMinLean = 0.02;

/// Rows of cells, none if last < first.
struct RowRange {
  std::int64_t first = 0, last = -1;
};
/// Rows with north coordinates in [low, high], one more on each side.
RowRange rows_between(const CellPlane& plane, double low, double high) {
  const auto row_of = [&](double y) {
    return std::clamp(std::floor((y - plane.first.y()) / plane.spacing_m), -2.0, plane.rows + 1.0);
  };
  return {static_cast<std::int64_t>(std::max(0.0, row_of(low) - 1)),
          static_cast<std::int64_t>(std::min(plane.rows - 1.0, row_of(high) + 1))};
}

/// Angles of containment()'s rays from east, counter-clockwise, ascending, in [0, 2 pi).
std::array<double, kLevelRays> ray_angles() {
  std::array<double, kLevelRays> angles{};
  for (int i = 0; i < kLevelRays; ++i) {
    double angle = geodesy::kPi / 2 - raytrace::level_ray_azimuth_rad(i);
    while (angle < 0) angle += 2 * geodesy::kPi;
    angles[static_cast<std::size_t>(i)] = angle;
  }
  std::sort(angles.begin(), angles.end());
  return angles;
}

}  // namespace

Interiors::Interiors(const city::Mesh& mesh) {
  std::map<std::pair<Point, Point>, int> runs;  // of an edge from its lower end (z first) to its upper
  const auto upwards_key = [](const Point& p) { return Point{p[2], p[0], p[1]}; };
  double north_m = -1e300;
  south_m_ = 1e300;
  for (const city::Object& object : mesh.objects) {
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
      Triangle triangle;
      triangle.building = object.surface == city::Surface::Building;
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Vector3d& v = mesh.vertices[mesh.triangles[t][k]];
        triangle.corner[k] = {v.x() + 0.0, v.y() + 0.0, v.z() + 0.0};  // no -0: equal points have equal keys
        south_m_ = std::min(south_m_, v.y());
        north_m = std::max(north_m, v.y());
      }
      triangles_.push_back(triangle);
      if (!triangle.building) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        const Point &from = triangle.corner[k], &to = triangle.corner[(k + 1) % 3];
        if (from[2] == to[2]) continue;  // no plane intersects it
        const bool up = from[2] < to[2];
        runs[{upwards_key(up ? from : to), upwards_key(up ? to : from)}] += up ? 1 : -1;
      }
    }
  }
  for (const auto& [edge, upwards] : runs) {
    if (upwards == 0) continue;
    const auto& [low, high] = edge;
    open_edges_.push_back({{low[1], low[2], low[0]}, {high[1], high[2], high[0]}, upwards});
  }
  if (triangles_.empty()) return;

  band_m_ = std::max((north_m - south_m_) / kBands, 1e-3);
  const auto bands_of = [&](std::uint32_t t, const auto& call) {
    const auto& corner = triangles_[t].corner;
    const auto [low, high] = std::minmax({corner[0][1], corner[1][1], corner[2][1]});
    const auto band = [&](double y) {
      return std::min(kBands - 1, static_cast<std::size_t>(std::max(0.0, (y - south_m_) / band_m_)));
    };
    for (std::size_t b = band(low); b <= band(high); ++b) call(b);
  };
  bands_.fill(kBands, static_cast<std::uint32_t>(triangles_.size()), bands_of);
}

std::vector<Interiors::End> Interiors::ends(double z) const {
  std::vector<End> ends;
  for (const OpenEdge& edge : open_edges_) {
    if (is_above(edge.low, z) || !is_above(edge.high, z)) continue;
    // Seen from its front a triangle's upward edge is on the right, where its segment ends.
    const auto [x, y] = cut(edge.low, edge.high, z);
    ends.push_back({x, y, -edge.upwards});
  }
  return ends;
}

std::size_t Interiors::open_ends(double z) const {
  std::size_t count = 0;
  for (const End& end : ends(z)) count += static_cast<std::size_t>(std::abs(end.begins));
  return count;
}

/// Calls call(triangle, from, to) for segments in the plane that may be within `margin_m` of the tile's rows.
template <class Call>
void Interiors::for_each_segment(const CellPlane& plane, double margin_m, const Call& call) const {
  if (triangles_.empty()) return;
  const double z = plane.z;
  const double south_m = plane.first.y() - margin_m;
  const double north_m = plane.first.y() + (plane.rows - 1) * plane.spacing_m + margin_m;
  const auto band = [&](double y) {
    return static_cast<std::size_t>(std::clamp((y - south_m_) / band_m_, 0.0, kBands - 1.0));
  };
  const std::size_t first_band = band(south_m), last_band = band(north_m);
  std::vector<std::uint32_t> near;
  bands_.append(first_band, last_band, near);
  if (first_band != last_band) sort_unique(near);
  for (const std::uint32_t t : near) {
    const auto& corner = triangles_[t].corner;
    const std::array above{is_above(corner[0], z), is_above(corner[1], z), is_above(corner[2], z)};
    if (above[0] == above[1] && above[1] == above[2]) continue;
    std::array<double, 2> from{}, to{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t l = (k + 1) % 3;
      if (above[k] == above[l]) continue;
      (above[l] ? to : from) = cut(corner[k], corner[l], z);
    }
    if (std::max(from[1], to[1]) < south_m || std::min(from[1], to[1]) > north_m) continue;
    call(triangles_[t], from, to);
  }
}

/// crossings[i] is the count for the ray from cell i towards the east.
void Interiors::count_rows(const CellPlane& plane, std::vector<std::int32_t>& crossings) const {
  // First, crossings[row, c] counts the segments east of cell c but not of cell c + 1.
  crossings.assign(std::size_t{plane.columns} * plane.rows, 0);
  for_each_segment(plane, 0, [&](const Triangle& triangle, const auto& from, const auto& to) {
    if (!triangle.building || from[1] == to[1]) return;
    const int direction = to[1] > from[1] ? 1 : -1;
    const RowRange rows = rows_between(plane, std::min(from[1], to[1]), std::max(from[1], to[1]));
    for (std::int64_t r = rows.first; r <= rows.last; ++r) {
      const double y = plane.first.y() + static_cast<double>(r) * plane.spacing_m;
      // Half open, so that a chain through a vertex is crossed once.
      if ((from[1] <= y) == (to[1] <= y)) continue;
      const double x = from[0] + (y - from[1]) / (to[1] - from[1]) * (to[0] - from[0]);
      const double west = std::ceil((x - plane.first.x()) / plane.spacing_m);  // cells west of it
      if (west < 1) continue;
      const auto last = static_cast<std::size_t>(std::min(west, static_cast<double>(plane.columns))) - 1;
      crossings[static_cast<std::size_t>(r) * plane.columns + last] += direction;
    }
  });
  for (std::size_t r = 0; r < plane.rows; ++r) {
    std::int32_t sum = 0;
    for (std::size_t c = plane.columns; c-- > 0;) {
      std::int32_t& count = crossings[r * plane.columns + c];
      sum += count;
      count = sum;
    }
  }
}

std::vector<std::uint32_t> Interiors::on_surfaces(const CellPlane& plane, double distance_m) const {
  std::vector<std::uint32_t> cells;
  if (plane.columns == 0 || plane.rows == 0) return cells;
  // A sloping surface is up to this much farther in the plane than in space; flatter ones are not followed.
  const double max_m = distance_m / kMinLean;
  for_each_segment(plane, max_m, [&](const Triangle& triangle, const auto& from, const auto& to) {
    const Eigen::Map<const Eigen::Vector3d> a(triangle.corner[0].data()), b(triangle.corner[1].data()),
        c(triangle.corner[2].data());
    const Eigen::Vector3d normal = (b - a).cross(c - a).stableNormalized();
    const double reach_m = distance_m / std::max(normal.template head<2>().norm(), kMinLean);
    const Eigen::Vector2d start(from[0], from[1]), side(to[0] - from[0], to[1] - from[1]);
    const double length2 = side.squaredNorm();
    const RowRange rows =
        rows_between(plane, std::min(from[1], to[1]) - reach_m, std::max(from[1], to[1]) + reach_m);
    for (std::int64_t r = rows.first; r <= rows.last; ++r) {
      const double y = plane.first.y() + static_cast<double>(r) * plane.spacing_m;
      // The part of the segment that may be near the row.
      double share1 = 0, share2 = 1;
      if (std::abs(side.y()) > reach_m) {
        share1 = std::clamp((y - reach_m - start.y()) / side.y(), 0.0, 1.0);
        share2 = std::clamp((y + reach_m - start.y()) / side.y(), 0.0, 1.0);
      }
      const auto [west, east] = std::minmax({start.x() + share1 * side.x(), start.x() + share2 * side.x()});
      const auto column = [&](double x) {
        return std::clamp((x - plane.first.x()) / plane.spacing_m, -1.0, plane.columns + 0.0);
      };
      const auto first = static_cast<std::int64_t>(std::max(0.0, std::ceil(column(west - reach_m))));
      const auto last =
          static_cast<std::int64_t>(std::min(plane.columns - 1.0, std::floor(column(east + reach_m))));
      for (std::int64_t k = first; k <= last; ++k) {
        const Eigen::Vector2d point(plane.first.x() + static_cast<double>(k) * plane.spacing_m, y);
        const double fraction = length2 > 0 ? std::clamp((point - start).dot(side) / length2, 0.0, 1.0) : 0.0;
        if ((start + fraction * side - point).norm() > reach_m) continue;
        cells.push_back(static_cast<std::uint32_t>(r * plane.columns + k));
      }
    }
  });
  sort_unique(cells);
  return cells;
}

bool Interiors::find(const CellPlane& plane, std::span<const std::uint8_t> wanted,
                     std::span<std::uint8_t> inside) const {
  assert(wanted.size() == std::size_t{plane.columns} * plane.rows && inside.size() == wanted.size());
  const std::vector<End> open = ends(plane.z);
  if (open.size() > kMaxEnds) return false;
  std::fill(inside.begin(), inside.end(), std::uint8_t{0});
  if (wanted.empty()) return true;
  std::vector<std::int32_t> crossings;
  count_rows(plane, crossings);
  static const std::array<double, kLevelRays> angles = ray_angles();
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (wanted[i] == 0) continue;
    const double x = plane.first.x() + static_cast<double>(i % plane.columns) * plane.spacing_m;
    const double y = plane.first.y() + static_cast<double>(i / plane.columns) * plane.spacing_m;
    // A ray crosses chains that begin between it and east; the ray to the east does not.
    std::array<int, kLevelRays> leaves{};
    leaves.fill(crossings[i]);
    for (const End& end : open) {
      double angle = std::atan2(end.y - y, end.x - x);
      if (angle < 0) angle += 2 * geodesy::kPi;
      for (std::size_t k = kLevelRays; k-- > 0 && angles[k] >= angle;) leaves[k] += end.begins;
    }
    inside[i] = raytrace::is_inside(leaves);
  }
  return true;
}

}  // namespace canyon::heatmap
