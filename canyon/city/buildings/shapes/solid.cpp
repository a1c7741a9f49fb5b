#include "canyon/city/buildings/shapes/solid.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>

#include "canyon/city/buildings/shapes/roof_planes.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/mesh_topology.hpp"

namespace canyon::buildings {
namespace {

using city::Material;
using city::Mesh;

/// Lower walls and roofs are not built, because they would be flat within the grid.
constexpr double kLowest_m = 1e-3;
constexpr double kLowestRoof_m = 0.01;
/// Narrower outlines get no ridge: its pieces would be near the millimetre grid of outlines.
constexpr double kNarrowestRoof_m = 0.1;

/// Appends vertices and triangles to a mesh and closes them as one object.
class ObjectWriter {
 public:
  explicit ObjectWriter(Mesh& mesh)
      : mesh_(mesh), first_(static_cast<std::uint32_t>(mesh.triangles.size())) {}

  std::uint32_t vertex(double x, double y, double z) {
    mesh_.vertices.emplace_back(x, y, z);
    return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
  }
  /// Skips triangles that use a vertex twice.
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, Material material) {
    if (a == b || b == c || c == a) return;
    mesh_.triangles.push_back({a, b, c});
    mesh_.materials.push_back(material);
  }
  void close(const std::string& name, city::Surface surface) {
    const auto count = static_cast<std::uint32_t>(mesh_.triangles.size()) - first_;
    if (count > 0) mesh_.objects.push_back({name, surface, first_, count});
  }

 private:
  Mesh& mesh_;
  std::uint32_t first_;
};

/// The roof of a shape; empty if the outline is unsuitable for it.
std::optional<RoofSurface> roof_surface(const Polygon2& polygon, const Plan& plan, const Shape& shape,
                                        double rise_m) {
  switch (shape.roof) {
    case RoofShape::Flat:
      return flat_surface(plan);
    case RoofShape::Dome:
      return surface_of_profile(plan, dome_profile(rise_m));
    case RoofShape::Onion:
      return surface_of_profile(plan, onion_profile(rise_m));
    case RoofShape::Pyramidal:
      if (auto spire = surface_of_profile(plan, spire_profile(rise_m))) return spire;
      break;
    default:
      break;
  }
  const RoofRectangle rectangle = roof_rectangle(polygon.outer, shape);
  if (2 * std::min(rectangle.half_width_m, rectangle.half_length_m) < kNarrowestRoof_m) return std::nullopt;
  return surface_of_planes(plan, roof_planes(shape.roof, rectangle, rise_m), rise_m);
}

using Triangle = std::array<std::uint32_t, 3>;
using IndexRing = std::vector<std::uint32_t>;

constexpr double kWeld_m = 1e-3;
constexpr double kSmallest_m2 = 1e-6;

/// Merges points within 1 mm (keeps the first).
class Welder {
 public:
  std::uint32_t add(const Eigen::Vector3d& point) {
    const std::array<std::int64_t, 3> cell = cell_of(point);
    for (std::int64_t dx = -1; dx <= 1; ++dx) {
      for (std::int64_t dy = -1; dy <= 1; ++dy) {
        for (std::int64_t dz = -1; dz <= 1; ++dz) {
          const auto found = cells_.find({cell[0] + dx, cell[1] + dy, cell[2] + dz});
          if (found != cells_.end() && (points_[found->second] - point).norm() <= kWeld_m)
            return found->second;
        }
      }
    }
    const auto index = static_cast<std::uint32_t>(points_.size());
    points_.push_back(point);
    cells_.emplace(cell, index);  // a cell (1.7 mm across) keeps its first point only
    return index;
  }
  [[nodiscard]] const std::vector<Eigen::Vector3d>& points() const { return points_; }

 private:
  static std::array<std::int64_t, 3> cell_of(const Eigen::Vector3d& point) {
    return {std::llround(std::floor(point.x() / kWeld_m)), std::llround(std::floor(point.y() / kWeld_m)),
            std::llround(std::floor(point.z() / kWeld_m))};
  }
  std::vector<Eigen::Vector3d> points_;
  std::map<std::array<std::int64_t, 3>, std::uint32_t> cells_;
};

/// Twice the vector area of a ring, towards the side from which it is counter-clockwise (Newell's method).
Eigen::Vector3d twice_area_vector(const IndexRing& ring, const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < ring.size(); ++i)
    sum += (points[ring[i]] - points[ring[0]]).cross(points[ring[i + 1]] - points[ring[0]]);
  return sum;
}

/// The ring without repeated points and without spikes (a, b, a).
IndexRing tidy(IndexRing ring) {
  bool again = true;
  while (again && ring.size() >= 3) {
    again = false;
    for (std::size_t i = 0; i < ring.size() && ring.size() >= 3; ++i) {
      const std::size_t next = (i + 1) % ring.size();
      const std::size_t after = (i + 2) % ring.size();
      if (ring[i] == ring[next] || ring[i] == ring[after]) {
        ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(next));
        again = true;
        break;
      }
    }
  }
  return ring;
}

/// Largest distance of a ring's corners from its plane [m].
double off_plane_m(const IndexRing& ring, const std::vector<Eigen::Vector3d>& points) {
  const Eigen::Vector3d normal = twice_area_vector(ring, points).normalized();
  double low = 0, high = 0;
  for (const std::uint32_t i : ring) {
    const double off = normal.dot(points[i] - points[ring[0]]);
    low = std::min(low, off);
    high = std::max(high, off);
  }
  return high - low;
}

/// Triangles of a polygon in space, with its front side; empty for a ring that is not a polygon.
std::vector<Triangle> triangles_of(const IndexRing& outer, const std::vector<IndexRing>& inners,
                                   const std::vector<Eigen::Vector3d>& points) {
  if (outer.size() < 3) return {};
  const Eigen::Vector3d front = twice_area_vector(outer, points);
  if (!(0.5 * front.norm() > kSmallest_m2)) return {};
  if (outer.size() == 3 && inners.empty()) return {{outer[0], outer[1], outer[2]}};
  // Projects along the axis closest to its normal, from its front side: a linear map, so that the
  // triangulation is one of the polygon itself.
  Eigen::Index axis = 0;
  front.cwiseAbs().maxCoeff(&axis);
  Eigen::Index u = (axis + 1) % 3;
  Eigen::Index v = (axis + 2) % 3;
  if (front[axis] < 0) std::swap(u, v);
  const Eigen::Vector3d& origin = points[outer[0]];
  Polygon2 flat;
  std::vector<std::uint32_t> index;
  const auto flatten = [&](const IndexRing& ring) {
    std::vector<Point2> result;
    for (const std::uint32_t i : ring) {
      result.emplace_back(points[i][u] - origin[u], points[i][v] - origin[v]);
      index.push_back(i);
    }
    return result;
  };
  flat.outer = flatten(outer);
  for (IndexRing inner : inners) {
    if (inner.size() < 3) continue;
    if (twice_area_vector(inner, points)[axis] * front[axis] > 0) std::reverse(inner.begin(), inner.end());
    flat.holes.push_back(flatten(inner));
  }
  const std::vector<Polygon2> face{flat};
  if (is_tangled({&face}, kMaxCrossings)) return {};
  std::vector<Triangle> triangles = triangulate(flat);
  for (Triangle& triangle : triangles)
    for (std::uint32_t& corner : triangle) corner = index[corner];
  return triangles;
}

/// Whether every directed edge has exactly one opposite.
bool watertight(const std::vector<Triangle>& triangles) {
  std::unordered_map<std::uint64_t, int> edges;
  const auto key = [](std::uint32_t from, std::uint32_t to) { return (std::uint64_t{from} << 32) | to; };
  for (const Triangle& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) ++edges[key(t[k], t[(k + 1) % 3])];
  return std::all_of(edges.begin(), edges.end(), [&](const auto& edge) {
    const auto opposite = edges.find((edge.first << 32) | (edge.first >> 32));
    return edge.second == 1 && opposite != edges.end() && opposite->second == 1;
  });
}

std::vector<LocalSurface> surfaces_in(const std::vector<MapSurface>& surfaces,
                                      const geodesy::LocalFrame& frame) {
  const auto ring = [&](const std::vector<Eigen::Vector3d>& points) {
    std::vector<Eigen::Vector3d> local;
    local.reserve(points.size());
    for (const Eigen::Vector3d& p : points)
      local.push_back(frame.local_from_geodetic(geodesy::Geodetic::from_degrees(p.y(), p.x(), p.z())));
    return local;
  };
  std::vector<LocalSurface> result;
  result.reserve(surfaces.size());
  for (const MapSurface& surface : surfaces) {
    LocalSurface& next = result.emplace_back();
    next.outer = ring(surface.outer);
    for (const auto& inner : surface.inners) next.inners.push_back(ring(inner));
    next.semantic = surface.semantic;
  }
  cut_openings(result);
  return result;
}

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

std::vector<Polygon2> flat_polygons(const FacePlane& plane, const LocalSurface& surface) {
  Polygon2 raw{plane.flat(surface.outer), {}};
  for (const Ring3& inner : surface.inners) raw.holes.push_back(plane.flat(inner));
  std::vector<std::string> notes;
  return repair({raw}, notes);
}

/// The openings in `all` that are in a wall, projected to its plane.
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
    if (2 * total_area(intersect(flat, wall_polygons)) < total_area(flat) || flat.empty()) continue;
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

void append_solid(Mesh& mesh, const std::string& name, city::Surface surface, const Polygon2& polygon,
                  const Shape& shape, double base_m, double bottom_m, std::vector<std::string>& notes) {
  const double bottom = shape.min_height_m > 0 ? base_m + shape.min_height_m : bottom_m;
  const double top = base_m + shape.height_m;
  assert(shape.height_m > shape.min_height_m &&
         shape.height_m - shape.roof_height_m >= shape.min_height_m - 1e-9);
  if (!(top - bottom >= kLowest_m)) {
    notes.emplace_back("no height");
    return;
  }
  const Plan plan(polygon);
  if (plan.triangles.empty()) {
    notes.emplace_back(kNoTriangles);
    return;
  }
  const double rise = shape.roof == RoofShape::Flat || shape.roof_height_m < kLowestRoof_m
                          ? 0
                          : std::min(shape.roof_height_m, top - bottom);
  double eaves = top - rise;
  std::optional<RoofSurface> roof = rise > 0 ? roof_surface(polygon, plan, shape, rise) : flat_surface(plan);
  if (!roof) {
    notes.push_back(
        fmt::format("outline is unsuitable for roof:shape={}: built flat at half the roof's height",
                    buildings::name(shape.roof)));
    eaves = top - 0.5 * rise;
    roof = flat_surface(plan);
  }

  // A roof that reaches the bottom has no wall there: both have the same vertex.
  ObjectWriter object(mesh);
  std::vector<std::uint32_t> low(plan.corners.size()), high(roof->vertices.size());
  for (std::size_t i = 0; i < low.size(); ++i) {
    low[i] = plan.first[i] == i ? object.vertex(plan.corners[i].x(), plan.corners[i].y(), bottom)
                                : low[plan.first[i]];
  }
  for (std::size_t i = 0; i < high.size(); ++i) {
    const Eigen::Vector3d& v = roof->vertices[i];
    const bool is_corner = i < low.size();
    if (is_corner && plan.first[i] != i)
      high[i] = high[plan.first[i]];
    else if (is_corner && eaves + v.z() < bottom + kLowest_m)
      high[i] = low[i];
    else
      high[i] = object.vertex(v.x(), v.y(), std::max(bottom, eaves + v.z()));
  }
  for (const auto& t : plan.triangles) object.triangle(low[t[2]], low[t[1]], low[t[0]], shape.facade);
  for (std::size_t i = 0; i < low.size(); ++i) {
    // A fan from the left corner (seen from outside) to the rim of the roof, from right to left: roofs are
    // concave along a wall, so no triangle flips.
    const std::uint32_t j = plan.next[i];
    std::uint32_t right = low[j], rim = high[j];
    object.triangle(low[i], right, rim, shape.facade);
    for (auto v = roof->on_edge[i].rbegin(); v != roof->on_edge[i].rend(); ++v) {
      object.triangle(low[i], rim, high[*v], shape.facade);
      rim = high[*v];
    }
    object.triangle(low[i], rim, high[i], shape.facade);
  }
  for (const auto& t : roof->triangles)
    object.triangle(high[t[0]], high[t[1]], high[t[2]], shape.roof_material);
  object.close(name, surface);
}

void append_tree(Mesh& mesh, const std::string& name, const Point2& point, double base_m, double height_m,
                 double crown_diameter_m) {
  constexpr std::uint32_t kTrunkSides = 6, kMeridians = 8, kParallels = 3;
  const double trunk_radius = std::clamp(0.02 * height_m, 0.05, 0.5);
  const double crown_bottom = base_m + 0.25 * height_m, crown_top = base_m + height_m;
  const double trunk_top = base_m + 0.5 * height_m;  // within the crown
  ObjectWriter object(mesh);

  std::array<std::uint32_t, kTrunkSides> low{}, high{};
  for (std::uint32_t i = 0; i < kTrunkSides; ++i) {
    const double angle = 2 * M_PI * i / kTrunkSides;
    const double x = point.x() + trunk_radius * std::cos(angle),
                 y = point.y() + trunk_radius * std::sin(angle);
    low[i] = object.vertex(x, y, base_m);
    high[i] = object.vertex(x, y, trunk_top);
  }
  for (std::uint32_t i = 0; i < kTrunkSides; ++i) {
    const std::uint32_t j = (i + 1) % kTrunkSides;
    object.triangle(low[i], low[j], high[j], Material::Wood);
    object.triangle(low[i], high[j], high[i], Material::Wood);
    if (i > 0 && j > 0) {
      object.triangle(low[0], low[j], low[i], Material::Wood);
      object.triangle(high[0], high[i], high[j], Material::Wood);
    }
  }

  // An ellipsoid between its poles; parallels from south to north.
  const double half_height = 0.5 * (crown_top - crown_bottom), middle = 0.5 * (crown_top + crown_bottom);
  const std::uint32_t south = object.vertex(point.x(), point.y(), crown_bottom);
  std::array<std::array<std::uint32_t, kMeridians>, kParallels> rings{};
  for (std::uint32_t p = 0; p < kParallels; ++p) {
    const double latitude = M_PI * (p + 1.0) / (kParallels + 1) - 0.5 * M_PI;
    const double radius = 0.5 * crown_diameter_m * std::cos(latitude);
    for (std::uint32_t m = 0; m < kMeridians; ++m) {
      const double angle = 2 * M_PI * m / kMeridians;
      rings[p][m] = object.vertex(point.x() + radius * std::cos(angle), point.y() + radius * std::sin(angle),
                                  middle + half_height * std::sin(latitude));
    }
  }
  const std::uint32_t north = object.vertex(point.x(), point.y(), crown_top);
  for (std::uint32_t m = 0; m < kMeridians; ++m) {
    const std::uint32_t n = (m + 1) % kMeridians;
    object.triangle(south, rings[0][n], rings[0][m], Material::Foliage);
    for (std::uint32_t p = 0; p + 1 < kParallels; ++p) {
      object.triangle(rings[p][m], rings[p][n], rings[p + 1][n], Material::Foliage);
      object.triangle(rings[p][m], rings[p + 1][n], rings[p + 1][m], Material::Foliage);
    }
    object.triangle(rings[kParallels - 1][m], rings[kParallels - 1][n], north, Material::Foliage);
  }
  object.close(name, city::Surface::Foliage);
}

bool append_surfaces(city::Mesh& mesh, const std::string& name, const std::vector<MapSurface>& surfaces,
                     const geodesy::LocalFrame& frame, std::vector<std::string>& notes, city::Material facade,
                     city::Material roof) {
  Welder welder;
  const auto ring_of = [&](const std::vector<Eigen::Vector3d>& points) {
    IndexRing ring;
    for (const Eigen::Vector3d& p : points) ring.push_back(welder.add(p));
    return tidy(std::move(ring));
  };
  std::vector<Triangle> triangles;
  std::vector<city::Material> materials;
  std::vector<bool> open;  // of the triangles: closure surfaces, not built
  std::size_t left_out = 0, bent = 0, repaired = 0;
  const auto triangulated = [&](const LocalSurface& surface, const IndexRing& outer) {
    std::vector<IndexRing> inners;
    for (const auto& inner : surface.inners) inners.push_back(ring_of(inner));
    return triangles_of(outer, inners, welder.points());
  };
  for (const LocalSurface& surface : surfaces_in(surfaces, frame)) {
    const IndexRing outer = ring_of(surface.outer);
    std::vector<Triangle> made = triangulated(surface, outer);
    if (made.empty()) {
      for (const LocalSurface& piece : mended(surface)) {
        const std::vector<Triangle> more = triangulated(piece, ring_of(piece.outer));
        made.insert(made.end(), more.begin(), more.end());
      }
      ++(made.empty() ? left_out : repaired);
    }
    constexpr double kFlat_m = 0.5;
    if (made.size() > 1 && off_plane_m(outer, welder.points()) > kFlat_m) ++bent;
    triangles.insert(triangles.end(), made.begin(), made.end());
    const city::Material material = surface.semantic == "RoofSurface" ? roof
                                    : surface.semantic == "Window"    ? city::Material::Glass
                                                                      : facade;
    materials.insert(materials.end(), made.size(), material);
    open.insert(open.end(), made.size(), surface.semantic == "ClosureSurface");
  }
  if (repaired > 0) {
    notes.push_back(fmt::format("{}: repaired {} of {} surfaces whose rings cross or touch", name, repaired,
                                surfaces.size()));
  }
  if (left_out > 0) {
    notes.push_back(
        fmt::format("{}: left out {} of {} surfaces that are not polygons", name, left_out, surfaces.size()));
  }
  if (bent > 0) {
    notes.push_back(fmt::format("{}: {} of {} surfaces deviate by more than 0.5 m from their planes", name,
                                bent, surfaces.size()));
  }
  const std::vector<Eigen::Vector3d>& points = welder.points();
  for (const auto& component : city::connected_components(triangles, points.size())) {
    city::TriangleIndices own;
    for (const std::uint32_t t : component) own.push_back(triangles[t]);
    city::orient_outwards(points, own);
    for (std::size_t i = 0; i < own.size(); ++i) triangles[component[i]] = own[i];
  }
  const bool closed = watertight(triangles);
  // Degenerate triangles are removed last, because the test for closed surfaces needs them.
  std::vector<Triangle> kept;
  std::vector<city::Material> kept_materials;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const auto& [a, b, c] = triangles[t];
    if (open[t] || city::is_degenerate(points[a], points[b], points[c])) continue;
    kept.push_back(triangles[t]);
    kept_materials.push_back(materials[t]);
  }
  if (kept.empty()) return false;
  if (!closed) notes.push_back(fmt::format("{}: its surfaces are not closed", name));
  const std::size_t first = mesh.triangles.size();
  city::append_object(mesh, name, city::Surface::Building, facade, points, kept);
  std::copy(kept_materials.begin(), kept_materials.end(),
            mesh.materials.begin() + static_cast<std::ptrdiff_t>(first));
  return true;
}

std::vector<LocalSurface> mended(const LocalSurface& surface) {
  if (surface.outer.size() < 3 || area_vector(surface.outer).norm() < 1e-6) return {};
  const FacePlane plane(surface.outer);
  std::vector<LocalSurface> pieces;
  append_pieces(plane, flat_polygons(plane, surface), surface.semantic, pieces);
  return pieces;
}

void cut_openings(std::vector<LocalSurface>& surfaces) {
  std::vector<const LocalSurface*> openings;
  for (const LocalSurface& surface : surfaces)
    if (is_opening(surface) && surface.outer.size() >= 3) openings.push_back(&surface);
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
