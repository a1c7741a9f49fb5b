#include "canyon/city/buildings/shapes/solid.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <optional>

#include "canyon/city/buildings/shapes/roof_planes.hpp"
#include "canyon/city/city.hpp"

namespace canyon::buildings {
namespace {

using city::Material;
using city::Mesh;

/// Lower walls, and roofs that rise less, are not made: what is left of them is as flat as the grid.
constexpr double kLowest_m = 1e-3;
constexpr double kLowestRoof_m = 0.01;
/// Narrower outlines carry no ridge: its pieces would come near the millimetre to which outlines are snapped.
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
  /// Leaves out triangles that name a vertex twice.
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

/// The roof of a shape, empty where the outline does not bear it.
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
    notes.push_back(fmt::format("outline cannot bear roof:shape={}: flat at half the roof's height",
                                buildings::name(shape.roof)));
    eaves = top - 0.5 * rise;
    roof = flat_surface(plan);
  }

  // A roof that comes down to the bottom has no wall there: both have the same vertex.
  ObjectWriter object(mesh);
  std::vector<std::uint32_t> low(plan.corners.size()), high(roof->vertices.size());
  for (std::size_t i = 0; i < low.size(); ++i) {
    low[i] = plan.first[i] == i ? object.vertex(plan.corners[i].x(), plan.corners[i].y(), bottom)
                                : low[plan.first[i]];
  }
  for (std::size_t i = 0; i < high.size(); ++i) {
    const Eigen::Vector3d& v = roof->vertices[i];
    const bool is_corner = i < low.size();
    if (is_corner && plan.first[i] != i) {
      high[i] = high[plan.first[i]];
    } else if (is_corner && eaves + v.z() < bottom + kLowest_m) {
      high[i] = low[i];
    } else {
      high[i] = object.vertex(v.x(), v.y(), std::max(bottom, eaves + v.z()));
    }
  }
  for (const auto& t : plan.triangles) object.triangle(low[t[2]], low[t[1]], low[t[0]], shape.facade);
  for (std::size_t i = 0; i < low.size(); ++i) {
    // A fan goes from the corner at the left (seen from outside) to the rim of the roof, from right to left:
    // roofs are concave along a wall, so that no triangle turns over.
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

void append_tree(Mesh& mesh, const std::string& name, const Point2& place, double base_m, double height_m,
                 double crown_diameter_m) {
  constexpr std::uint32_t kTrunkSides = 6, kMeridians = 8, kParallels = 3;
  const double trunk_radius = std::clamp(0.02 * height_m, 0.05, 0.5);
  const double crown_bottom = base_m + 0.25 * height_m, crown_top = base_m + height_m;
  const double trunk_top = base_m + 0.5 * height_m;  // within the crown
  ObjectWriter object(mesh);

  std::array<std::uint32_t, kTrunkSides> low{}, high{};
  for (std::uint32_t i = 0; i < kTrunkSides; ++i) {
    const double angle = 2 * M_PI * i / kTrunkSides;
    const double x = place.x() + trunk_radius * std::cos(angle),
                 y = place.y() + trunk_radius * std::sin(angle);
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
  const std::uint32_t south = object.vertex(place.x(), place.y(), crown_bottom);
  std::array<std::array<std::uint32_t, kMeridians>, kParallels> rings{};
  for (std::uint32_t p = 0; p < kParallels; ++p) {
    const double latitude = M_PI * (p + 1.0) / (kParallels + 1) - 0.5 * M_PI;
    const double radius = 0.5 * crown_diameter_m * std::cos(latitude);
    for (std::uint32_t m = 0; m < kMeridians; ++m) {
      const double angle = 2 * M_PI * m / kMeridians;
      rings[p][m] = object.vertex(place.x() + radius * std::cos(angle), place.y() + radius * std::sin(angle),
                                  middle + half_height * std::sin(latitude));
    }
  }
  const std::uint32_t north = object.vertex(place.x(), place.y(), crown_top);
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

}  // namespace canyon::buildings
