#include "canyon/city/link_shapes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/mesh_marks.hpp"

namespace canyon::city {
namespace {

using Eigen::Affine3d;
using Eigen::Vector3d;

struct Ring {
  double radius, z;
};

/// A closed surface of revolution about the z axis: rings of `sides` vertices from the lowest to the highest,
/// between two points on the axis. Empty if it has no extent.
TriangleSet revolve(double bottom, const std::vector<Ring>& rings, double top, int sides) {
  TriangleSet set;
  if (!is_extent({rings.front().radius, top - bottom, 1})) return set;
  set.vertices = {{0, 0, bottom}, {0, 0, top}};
  for (const Ring& ring : rings) {
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * geodesy::kPi * i / sides;
      set.vertices.emplace_back(ring.radius * std::cos(angle), ring.radius * std::sin(angle), ring.z);
    }
  }
  const int last = static_cast<int>(rings.size()) - 1;
  const auto at = [sides](int ring, int i) {
    return static_cast<std::uint32_t>(2 + ring * sides + i % sides);
  };
  for (int i = 0; i < sides; ++i) {
    set.triangles.push_back({0, at(0, i + 1), at(0, i)});
    set.triangles.push_back({1, at(last, i), at(last, i + 1)});
    for (int ring = 0; ring < last; ++ring) {
      set.triangles.push_back({at(ring, i), at(ring, i + 1), at(ring + 1, i + 1)});
      set.triangles.push_back({at(ring, i), at(ring + 1, i + 1), at(ring + 1, i)});
    }
  }
  return set;
}

bool names_terrain(const std::string& name) {
  return split_surface(name).surface == Surface::Terrain;
}

/// Flips each connected part so that front sides face outwards, for terrain upwards.
void orient(const std::vector<Vector3d>& vertices, TriangleIndices& triangles, bool terrain) {
  const auto components = connected_components(triangles, vertices.size());
  for (const std::vector<std::uint32_t>& component : components) {
    TriangleIndices part;
    part.reserve(component.size());
    for (const std::uint32_t t : component) part.push_back(triangles[t]);
    orient_outwards(vertices, part);
    if (terrain) face_up(vertices, part);
    for (std::size_t i = 0; i < component.size(); ++i) triangles[component[i]] = part[i];
  }
}

/// The middle of a node's bounds, which SDF's <center> moves to the origin.
Vector3d middle_of(const std::vector<Vector3d>& vertices) {
  if (vertices.empty()) return Vector3d::Zero();
  Box box;
  for (const Vector3d& v : vertices) extend(box, v);
  return middle_of(box);
}

/// Step between the heights used of a grid that is too fine. It divides both sides, so that the last row and
/// column are kept.
int stride_of(int columns, int rows) {
  int stride = 1;
  for (int n = 2; n < std::min(columns, rows) && (std::max(columns, rows) - 1) / stride >= kFinestHeightmap;
       ++n)
    if ((columns - 1) % n == 0 && (rows - 1) % n == 0) stride = n;
  return stride;
}

}  // namespace

/// Triangles of one future object.
struct LinkShapes::Soup {
  std::vector<Vector3d> vertices;
  TriangleIndices triangles;
  std::vector<Material> materials;  ///< one per triangle

  void add(const std::vector<Vector3d>& points, const TriangleIndices& corners, Material material,
           const Vector3d& origin = Vector3d::Zero()) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    for (const Vector3d& point : points) vertices.emplace_back(point - origin);
    for (const auto& [a, b, c] : corners)
      if (std::max({a, b, c}) < points.size()) triangles.push_back({first + a, first + b, first + c});
    materials.resize(triangles.size(), material);
  }
};

void LinkShapes::note(const ShapePose& location, std::string_view what) const {
  notes_.push_back(fmt::format("'{}' {}", location.name, what));
}

void LinkShapes::leave_out(const ShapePose& location, std::string_view why) const {
  note(location, fmt::format("is left out: {}", why));
}

/// Adds `soup` (in the frame of `link_from_soup`) as one object.
void LinkShapes::append(const ShapePose& location, const std::string& object, Surface surface, Soup soup,
                        const Affine3d& link_from_soup, bool orient_it) {
  for (Vector3d& v : soup.vertices) v = link_from_soup * v;
  if (link_from_soup.linear().determinant() < 0)
    for (auto& triangle : soup.triangles) std::swap(triangle[1], triangle[2]);
  std::size_t kept = 0;
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    const auto& [a, b, c] = soup.triangles[t];
    for (const std::uint32_t v : {a, b, c}) {
      if (!(soup.vertices[v].norm() <= kMaxShape_m)) {
        return leave_out(location,
                         fmt::format("it extends farther than {:.0f} km from its link", kMaxShape_m / 1e3));
      }
    }
    if (is_degenerate(soup.vertices[a], soup.vertices[b], soup.vertices[c])) continue;
    soup.materials[kept] = soup.materials[t];
    soup.triangles[kept++] = soup.triangles[t];
  }
  soup.triangles.resize(kept);
  soup.materials.resize(kept);
  weld(soup.vertices, soup.triangles);
  if (orient_it) orient(soup.vertices, soup.triangles, surface == Surface::Terrain);
  append_object(mesh_, object, surface, soup.materials, soup.vertices, soup.triangles);
}

void LinkShapes::add(const ShapePose& location, const TriangleSet& set, bool orient_it) {
  const bool terrain = names_terrain(location.name);
  Soup soup;
  soup.add(set.vertices, set.triangles, terrain ? Material::Ground : location.material);
  append(location, location.name, terrain ? Surface::Terrain : Surface::Building, std::move(soup),
         location.link_from_shape, orient_it);
}

void LinkShapes::solid(const ShapePose& location, std::string_view what, const TriangleSet& set) {
  if (set.triangles.empty()) return leave_out(location, fmt::format("{} without extent", what));
  add(location, set);
}

void LinkShapes::plane(const ShapePose& location, const Vector3d& normal, Eigen::Vector2d size) {
  if (!normal.allFinite() || !(normal.norm() > 1e-6))
    return leave_out(location, "a plane with a normal of length 0");
  if (!(size.minCoeff() > 0)) return leave_out(location, "a plane without extent");
  if (size.maxCoeff() > kMaxPlane_m) {
    size = size.cwiseMin(kMaxPlane_m);
    note(location, fmt::format("is a plane cut to {:.0f} km about its origin", kMaxPlane_m / 1e3));
  }
  add(location, plane_mesh(normal.normalized(), size));
}

void LinkShapes::mesh(const ShapePose& location, const MeshFile& file, const MeshUse& use) {
  if (!use.scale.allFinite() || !(use.scale.cwiseAbs().minCoeff() > 0))
    return leave_out(location, "a mesh with a scale of 0");
  const bool chosen =
      !use.submesh.empty() && std::any_of(file.nodes.begin(), file.nodes.end(),
                                          [&](const MeshNode& node) { return node.name == use.submesh; });
  if (!use.submesh.empty() && !chosen) {
    note(location, fmt::format("names submesh '{}', which its mesh does not have: the whole mesh is used",
                               use.submesh));
  }
  const bool terrain = !file.marked && names_terrain(location.name);
  std::size_t other = 0, taken = 0;
  for (auto next = file.nodes.begin(); next != file.nodes.end();) {
    const std::string& name = next->name;
    Soup soup;
    for (; next != file.nodes.end() && next->name == name; ++next) {
      if (chosen && name != use.submesh) continue;
      if (next->triangles.empty()) {
        ++other;
        continue;
      }
      const Vector3d origin = chosen && use.center ? middle_of(next->vertices) : Vector3d(Vector3d::Zero());
      const Material material = !file.marked   ? location.material
                                : next->colour ? material_by_colour(*next->colour)
                                               : Material::Unknown;
      soup.add(next->vertices, next->triangles, material, origin);
    }
    if (soup.triangles.empty()) continue;
    ++taken;
    const NodeName node = read_node_name(name);
    const Surface surface = terrain ? Surface::Terrain : node.surface;
    if (!file.marked && surface == Surface::Terrain)
      soup.materials.assign(soup.materials.size(), Material::Ground);
    append(location, file.marked ? node.name : fmt::format("{}::{}", location.name, node.name), surface,
           std::move(soup), location.link_from_shape * Eigen::Scaling(use.scale), !file.marked);
  }
  if (other > 0) note(location, fmt::format("has {} submeshes without triangles, which are left out", other));
  if (taken == 0) leave_out(location, "its mesh has no triangle");
}

void LinkShapes::polylines(const ShapePose& location, const std::vector<Polyline>& polylines, double height,
                           const Extrude& extrude) {
  std::string key = fmt::format("{}", height);
  bool sound = is_extent({1, 1, height}) && !polylines.empty();
  for (const Polyline& polyline : polylines) {
    sound = sound && polyline.size() >= 3;
    for (const Eigen::Vector2d& point : polyline) {
      sound = sound && point.allFinite();
      fmt::format_to(std::back_inserter(key), " {} {}", point.x(), point.y());
    }
    key += ';';
  }
  if (!sound) return leave_out(location, "a polyline without height or with fewer than three points");
  const auto node = extrude(fmt::format("canyon_polyline_{:016x}", fnv1a(key)), polylines, height);
  if (!node || node->triangles.empty()) return leave_out(location, "its polyline cannot be extruded");
  add(location, {node->vertices, node->triangles}, true);
}

void LinkShapes::heights(const ShapePose& location, const HeightGrid& grid) {
  if (grid.columns < 2 || grid.rows < 2 || !is_extent({grid.size.x(), grid.size.y(), 1}))
    return leave_out(location, "a heightmap without extent");
  const int stride = stride_of(grid.columns, grid.rows);
  if (stride > 1) {
    note(location, fmt::format("is a heightmap of {} x {} heights, of which every {}th is used", grid.columns,
                               grid.rows, stride));
  }
  const double first_row_y = (grid.north_first ? 0.5 : -0.5) * grid.size.y();
  Soup soup;
  const int wide = (grid.columns - 1) / stride + 1, high = (grid.rows - 1) / stride + 1;
  soup.vertices.reserve(static_cast<std::size_t>(wide) * static_cast<std::size_t>(high));
  for (int row = 0; row < high; ++row) {
    for (int column = 0; column < wide; ++column) {
      soup.vertices.emplace_back((static_cast<double>(column) / (wide - 1) - 0.5) * grid.size.x(),
                                 first_row_y * (1 - 2 * static_cast<double>(row) / (high - 1)),
                                 grid.height(column * stride, row * stride));
    }
  }
  // Each cell is split as in ODE, from the next column to the next row.
  for (int row = 0; row + 1 < high; ++row) {
    for (int column = 0; column + 1 < wide; ++column) {
      const auto here = static_cast<std::uint32_t>(row * wide + column);
      const std::uint32_t below = here + static_cast<std::uint32_t>(wide);
      soup.triangles.push_back({here, below, here + 1});
      soup.triangles.push_back({below + 1, here + 1, below});
    }
  }
  if (first_row_y < 0)
    for (auto& triangle : soup.triangles) std::swap(triangle[1], triangle[2]);
  soup.materials.assign(soup.triangles.size(), Material::Ground);
  append(location, location.name, Surface::Terrain, std::move(soup),
         location.link_from_shape * Eigen::Translation3d(grid.position), false);
}

Material material_by_colour(const std::array<double, 3>& colour) {
  for (int m = 0; m <= static_cast<int>(Material::Foliage); ++m) {
    const auto [r, g, b] = material_colour(static_cast<Material>(m));
    constexpr double kTolerance = 2e-3;
    if (std::abs(colour[0] - r) < kTolerance && std::abs(colour[1] - g) < kTolerance &&
        std::abs(colour[2] - b) < kTolerance)
      return static_cast<Material>(m);
  }
  return Material::Unknown;
}

TriangleSet box_mesh(const Eigen::Vector3d& size) {
  TriangleSet set;
  if (!is_extent(size)) return set;
  for (int corner = 0; corner < 8; ++corner) {
    set.vertices.emplace_back(((corner & 1) != 0 ? 0.5 : -0.5) * size.x(),
                              ((corner & 2) != 0 ? 0.5 : -0.5) * size.y(),
                              ((corner & 4) != 0 ? 0.5 : -0.5) * size.z());
  }
  set.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return set;
}

TriangleSet cylinder_mesh(double radius, double length, int sides) {
  return revolve(-length / 2, {{radius, -length / 2}, {radius, length / 2}}, length / 2, sides);
}

TriangleSet cone_mesh(double radius, double length, int sides) {
  return revolve(-length / 2, {{radius, -length / 2}}, length / 2, sides);
}

TriangleSet capsule_mesh(double radius, double length, int sides) {
  if (length < 0) return {};
  std::vector<Ring> rings;
  const int quarter = sides / 4;
  for (int ring = 1; ring <= quarter; ++ring) {
    const double angle = geodesy::kPi / 2 * ring / quarter;
    rings.push_back({radius * std::sin(angle), -length / 2 - radius * std::cos(angle)});
  }
  for (int ring = length > 0 ? quarter : quarter - 1; ring > 0; --ring) {
    const Ring& mirrored = rings[static_cast<std::size_t>(ring) - 1];
    rings.push_back({mirrored.radius, -mirrored.z});
  }
  return revolve(-length / 2 - radius, rings, length / 2 + radius, sides);
}

TriangleSet sphere_mesh(double radius, int sides) {
  std::vector<Ring> rings;
  const int count = sides / 2 - 1;
  for (int ring = 0; ring < count; ++ring) {
    const double latitude = geodesy::kPi * (ring + 1) / (count + 1) - geodesy::kPi / 2;
    rings.push_back({radius * std::cos(latitude), radius * std::sin(latitude)});
  }
  return revolve(-radius, rings, radius, sides);
}

TriangleSet ellipsoid_mesh(const Eigen::Vector3d& radii, int sides) {
  TriangleSet set = sphere_mesh(is_extent(radii) ? 1 : 0, sides);
  for (Eigen::Vector3d& v : set.vertices) v = v.cwiseProduct(radii);
  return set;
}

TriangleSet plane_mesh(const Eigen::Vector3d& normal, const Eigen::Vector2d& size) {
  const Eigen::Matrix3d rotation =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal).toRotationMatrix();
  TriangleSet set;
  for (const auto& [x, y] : {std::pair{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}})
    set.vertices.emplace_back(rotation * Eigen::Vector3d(x * size.x(), y * size.y(), 0));
  set.triangles = {{0, 1, 2}, {0, 2, 3}};
  return set;
}

}  // namespace canyon::city
