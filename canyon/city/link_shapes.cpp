#include "canyon/city/link_shapes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <utility>

#include "canyon/base/text.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/city/mesh_topology.hpp"

namespace canyon::city {

using Eigen::Affine3d;
using Eigen::Vector3d;

namespace {

bool names_terrain(const std::string& name) {
  return split_surface(name).surface == Surface::Terrain;
}

/// Turns each connected part so that front sides look outwards; upwards where it is terrain.
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

/// The middle of a node's bounds, which SDF's <center> brings to the origin.
Vector3d middle_of(const std::vector<Vector3d>& vertices) {
  if (vertices.empty()) return Vector3d::Zero();
  Box box;
  for (const Vector3d& v : vertices) extend(box, v);
  return middle_of(box);
}

/// Step between the heights that are taken of a grid that is too fine. It divides both sides, so that the
/// last row and column are kept.
int stride_of(int columns, int rows) {
  int stride = 1;
  for (int n = 2; n < std::min(columns, rows) && (std::max(columns, rows) - 1) / stride >= kFinestHeightmap;
       ++n) {
    if ((columns - 1) % n == 0 && (rows - 1) % n == 0) stride = n;
  }
  return stride;
}

}  // namespace

/// Triangles of one object to be.
struct LinkShapes::Soup {
  std::vector<Vector3d> vertices;
  TriangleIndices triangles;
  std::vector<Material> materials;  ///< one per triangle

  void add(const std::vector<Vector3d>& points, const TriangleIndices& corners, Material material,
           const Vector3d& origin = Vector3d::Zero()) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    for (const Vector3d& point : points) vertices.emplace_back(point - origin);
    for (const auto& [a, b, c] : corners) {
      if (std::max({a, b, c}) < points.size()) triangles.push_back({first + a, first + b, first + c});
    }
    materials.resize(triangles.size(), material);
  }
};

void LinkShapes::note(const Place& place, std::string_view what) const {
  notes_.push_back(fmt::format("'{}' {}", place.name, what));
}

void LinkShapes::leave_out(const Place& place, std::string_view why) const {
  note(place, fmt::format("is left out: {}", why));
}

/// Takes `soup` (in the frame of `link_from_soup`) as one object.
void LinkShapes::append(const Place& place, const std::string& object, Surface surface, Soup soup,
                        const Affine3d& link_from_soup, bool orient_it) {
  for (Vector3d& v : soup.vertices) v = link_from_soup * v;
  if (link_from_soup.linear().determinant() < 0) {
    for (auto& triangle : soup.triangles) std::swap(triangle[1], triangle[2]);
  }
  std::size_t kept = 0;
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    const auto& [a, b, c] = soup.triangles[t];
    for (const std::uint32_t v : {a, b, c}) {
      if (!(soup.vertices[v].norm() <= kLargestShape_m)) {
        return leave_out(
            place, fmt::format("it reaches farther than {:.0f} km from its link", kLargestShape_m / 1e3));
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

void LinkShapes::add(const Place& place, const TriangleSet& set, bool orient_it) {
  const bool terrain = names_terrain(place.name);
  Soup soup;
  soup.add(set.vertices, set.triangles, terrain ? Material::Ground : place.material);
  append(place, place.name, terrain ? Surface::Terrain : Surface::Building, std::move(soup),
         place.link_from_shape, orient_it);
}

void LinkShapes::solid(const Place& place, std::string_view what, const TriangleSet& set) {
  if (set.triangles.empty()) return leave_out(place, fmt::format("{} without extent", what));
  add(place, set);
}

void LinkShapes::plane(const Place& place, const Vector3d& normal, Eigen::Vector2d size) {
  if (!normal.allFinite() || !(normal.norm() > 1e-6)) {
    return leave_out(place, "a plane with a normal of length 0");
  }
  if (!(size.minCoeff() > 0)) return leave_out(place, "a plane without extent");
  if (size.maxCoeff() > kLargestPlane_m) {
    size = size.cwiseMin(kLargestPlane_m);
    note(place, fmt::format("is a plane cut to {:.0f} km about its origin", kLargestPlane_m / 1e3));
  }
  add(place, plane_mesh(normal.normalized(), size));
}

void LinkShapes::mesh(const Place& place, const MeshFile& file, const MeshUse& use) {
  if (!use.scale.allFinite() || !(use.scale.cwiseAbs().minCoeff() > 0)) {
    return leave_out(place, "a mesh with a scale of 0");
  }
  const bool chosen =
      !use.submesh.empty() && std::any_of(file.nodes.begin(), file.nodes.end(),
                                          [&](const MeshNode& node) { return node.name == use.submesh; });
  if (!use.submesh.empty() && !chosen) {
    note(place, fmt::format("names submesh '{}', which its mesh does not have: the whole mesh is taken",
                            use.submesh));
  }
  const bool terrain = !file.marked && names_terrain(place.name);
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
      const Material material = !file.marked   ? place.material
                                : next->colour ? material_by_colour(*next->colour)
                                               : Material::Unknown;
      soup.add(next->vertices, next->triangles, material, origin);
    }
    if (soup.triangles.empty()) continue;
    ++taken;
    const NodeName node = read_node_name(name);
    const Surface surface = terrain ? Surface::Terrain : node.surface;
    if (!file.marked && surface == Surface::Terrain) {
      soup.materials.assign(soup.materials.size(), Material::Ground);
    }
    append(place, file.marked ? node.name : fmt::format("{}::{}", place.name, node.name), surface,
           std::move(soup), place.link_from_shape * Eigen::Scaling(use.scale), !file.marked);
  }
  if (other > 0) note(place, fmt::format("has {} submeshes without triangles, which are left out", other));
  if (taken == 0) leave_out(place, "its mesh holds no triangle");
}

void LinkShapes::polylines(const Place& place, const std::vector<Polyline>& polylines, double height,
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
  if (!sound) return leave_out(place, "a polyline without height or with fewer than three points");
  const auto node = extrude(fmt::format("canyon_polyline_{:016x}", fnv1a(key)), polylines, height);
  if (!node || node->triangles.empty()) return leave_out(place, "its polyline cannot be extruded");
  add(place, {node->vertices, node->triangles}, true);
}

void LinkShapes::heights(const Place& place, const HeightGrid& grid) {
  if (grid.columns < 2 || grid.rows < 2 || !is_extent({grid.size.x(), grid.size.y(), 1})) {
    return leave_out(place, "a heightmap without extent");
  }
  const int stride = stride_of(grid.columns, grid.rows);
  if (stride > 1) {
    note(place, fmt::format("is a heightmap of {} x {} heights, of which each {}th is taken", grid.columns,
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
  // Each cell is cut as ODE does, from the next column to the next row.
  for (int row = 0; row + 1 < high; ++row) {
    for (int column = 0; column + 1 < wide; ++column) {
      const auto here = static_cast<std::uint32_t>(row * wide + column);
      const std::uint32_t below = here + static_cast<std::uint32_t>(wide);
      soup.triangles.push_back({here, below, here + 1});
      soup.triangles.push_back({below + 1, here + 1, below});
    }
  }
  if (first_row_y < 0) {
    for (auto& triangle : soup.triangles) std::swap(triangle[1], triangle[2]);
  }
  soup.materials.assign(soup.triangles.size(), Material::Ground);
  append(place, place.name, Surface::Terrain, std::move(soup),
         place.link_from_shape * Eigen::Translation3d(grid.position), false);
}

Material material_by_colour(const std::array<double, 3>& colour) {
  for (int m = 0; m <= static_cast<int>(Material::Foliage); ++m) {
    const auto [r, g, b] = material_colour(static_cast<Material>(m));
    constexpr double kTolerance = 2e-3;
    if (std::abs(colour[0] - r) < kTolerance && std::abs(colour[1] - g) < kTolerance &&
        std::abs(colour[2] - b) < kTolerance) {
      return static_cast<Material>(m);
    }
  }
  return Material::Unknown;
}

}  // namespace canyon::city
