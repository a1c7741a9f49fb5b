#include "canyon/buildings/shapes/openings.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "canyon/buildings/shapes/footprint.hpp"

namespace canyon::buildings {
namespace {

using Ring3 = std::vector<Eigen::Vector3d>;

constexpr double kOnPlane_m = 0.05;
constexpr double kParallel = 0.99;  // cosine

bool is_opening(const LocalSurface& surface) {
  return surface.semantic == "Window" || surface.semantic == "Door";
}

/// The area vector of a ring [m^2].
Eigen::Vector3d area_vector(const Ring3& ring) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 2; i < ring.size(); ++i) sum += (ring[i - 1] - ring[0]).cross(ring[i] - ring[0]);
  return 0.5 * sum;
}

/// Axes in a surface's plane about its first corner.
struct FacePlane {
  explicit FacePlane(const Ring3& ring)
      : origin(ring.front()),
        normal(area_vector(ring).normalized()),
        u(normal.unitOrthogonal()),
        v(normal.cross(u)) {}
  Eigen::Vector3d origin, normal, u, v;

  [[nodiscard]] double off_m(const Eigen::Vector3d& p) const { return std::abs(normal.dot(p - origin)); }
  [[nodiscard]] std::vector<Point2> flat(const Ring3& ring) const {
    std::vector<Point2> points;
    points.reserve(ring.size());
    for (const Eigen::Vector3d& p : ring) points.emplace_back(u.dot(p - origin), v.dot(p - origin));
    return points;
  }
  [[nodiscard]] Ring3 lifted(const std::vector<Point2>& points) const {
    Ring3 ring;
    ring.reserve(points.size());
    for (const Point2& p : points) ring.push_back(origin + p.x() * u + p.y() * v);
    return ring;
  }
};

double area_of_all(const std::vector<Polygon2>& polygons) {
  double sum = 0;
  for (const Polygon2& polygon : polygons) sum += area(polygon);
  return sum;
}

std::vector<Polygon2> flat_polygons(const FacePlane& plane, const LocalSurface& surface) {
  Polygon2 raw{plane.flat(surface.outer), {}};
  for (const Ring3& inner : surface.inners) raw.holes.push_back(plane.flat(inner));
  std::vector<std::string> notes;
  return repair({raw}, notes);
}

/// The openings of `all` that lie in a wall, flat in its plane.
std::vector<Polygon2> openings_in(const LocalSurface& wall, const FacePlane& plane,
                                  const std::vector<const LocalSurface*>& all) {
  std::vector<Polygon2> wall_polygons, found;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : wall.outer) box.extend(p);
  for (const LocalSurface* opening : all) {
    const Ring3& ring = opening->outer;
    const bool near = std::all_of(ring.begin(), ring.end(), [&](const Eigen::Vector3d& p) {
      return plane.off_m(p) <= kOnPlane_m && box.exteriorDistance(p) <= 1;
    });
    if (!near || std::abs(area_vector(ring).normalized().dot(plane.normal)) < kParallel) continue;
    if (wall_polygons.empty()) wall_polygons = flat_polygons(plane, wall);
    const std::vector<Polygon2> flat = flat_polygons(plane, {ring, {}, {}});
    if (2 * area_of_all(intersect(flat, wall_polygons)) < area_of_all(flat) || flat.empty()) continue;
    found.insert(found.end(), flat.begin(), flat.end());
  }
  return found;
}

void append_pieces(const FacePlane& plane, const std::vector<Polygon2>& pieces, const std::string& semantic,
                   std::vector<LocalSurface>& to) {
  for (const Polygon2& piece : pieces) {
    LocalSurface& next = to.emplace_back();
    next.outer = plane.lifted(piece.outer);
    for (const auto& hole : piece.holes) next.inners.push_back(plane.lifted(hole));
    next.semantic = semantic;
  }
}

}  // namespace

std::vector<LocalSurface> mended(const LocalSurface& surface) {
  if (surface.outer.size() < 3 || area_vector(surface.outer).norm() < 1e-6) return {};
  const FacePlane plane(surface.outer);
  std::vector<LocalSurface> pieces;
  append_pieces(plane, flat_polygons(plane, surface), surface.semantic, pieces);
  return pieces;
}

void cut_openings(std::vector<LocalSurface>& surfaces) {
  std::vector<const LocalSurface*> openings;
  for (const LocalSurface& surface : surfaces) {
    if (is_opening(surface) && surface.outer.size() >= 3) openings.push_back(&surface);
  }
  if (openings.empty()) return;
  std::vector<LocalSurface> cut;
  cut.reserve(surfaces.size());
  for (const LocalSurface& surface : surfaces) {
    if (is_opening(surface) || surface.outer.size() < 3 || area_vector(surface.outer).norm() < 1e-6) {
      cut.push_back(surface);
      continue;
    }
    const FacePlane plane(surface.outer);
    const std::vector<Polygon2> holes = openings_in(surface, plane, openings);
    if (holes.empty()) {
      cut.push_back(surface);
      continue;
    }
    append_pieces(plane, subtract(flat_polygons(plane, surface), unite(holes)), surface.semantic, cut);
  }
  surfaces = std::move(cut);
}

}  // namespace canyon::buildings
