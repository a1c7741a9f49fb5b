#include "canyon/buildings/ground.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/input_error.hpp"

namespace canyon::buildings {
namespace {

constexpr double kStep_m = 10;
// A chord of this length lies s^2 / (8 R) = 5 mm below the sphere.
constexpr double kFlatSpacing_m = 500;
constexpr double kMostPosts = 25e6;
constexpr double kMetresPerDegree = 111'320;  // of latitude, for step lengths only

void append_flat_sheet(city::Mesh& mesh, const geodesy::LocalFrame& frame,
                       const Eigen::AlignedBox2d& bounds) {
  const auto posts = [](double length) {
    return static_cast<std::uint32_t>(std::max(1.0, std::ceil(length / kFlatSpacing_m))) + 1;
  };
  const Eigen::Vector2d size = bounds.sizes();
  const std::uint32_t columns = posts(size.x()), rows = posts(size.y());
  std::vector<Eigen::Vector3d> vertices;
  for (std::uint32_t j = 0; j < rows; ++j) {
    for (std::uint32_t i = 0; i < columns; ++i) {
      const Eigen::Vector2d at =
          bounds.min() + Eigen::Vector2d(size.x() * i / (columns - 1), size.y() * j / (rows - 1));
      // The drop below the frame's plane, to first order in it: what is left is d^4 / (8 R^3), 1 mm at 38 km.
      const double above = frame.geodetic_from_local({at.x(), at.y(), 0}).height_m - frame.origin().height_m;
      vertices.emplace_back(at.x(), at.y(), -above);
    }
  }
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (std::uint32_t j = 0; j + 1 < rows; ++j) {
    for (std::uint32_t i = 0; i + 1 < columns; ++i) {
      const std::uint32_t a = j * columns + i, b = a + 1, c = a + columns, d = c + 1;
      triangles.push_back({a, b, d});
      triangles.push_back({a, d, c});
    }
  }
  city::append_object(mesh, "terrain", city::Surface::Terrain, city::Material::Ground, vertices, triangles);
}

}  // namespace

std::optional<Ground> ground_along(const std::vector<MapPolygon>& polygons, const MapFrame& map_frame,
                                   bool terrain) {
  Ground ground;
  double sum = 0;
  std::size_t count = 0;
  const auto add = [&](const LonLat& place) {
    const std::optional<double> height = map_frame.ground_height_m(place);
    if (!height) return;
    const double z = map_frame.mesh_from_map(place, *height).z();
    sum += z;
    if (count++ == 0 || z < ground.lowest_z) {
      ground.lowest_z = z;
      ground.lowest_height_m = *height;
    }
  };
  for (const MapPolygon& polygon : polygons) {
    for (std::size_t i = 0; i < polygon.outer.size(); ++i) {
      const LonLat& a = polygon.outer[i];
      add(a);
      if (!terrain) continue;
      const LonLat& b = polygon.outer[(i + 1) % polygon.outer.size()];
      const double length_m = (b - a).norm() * kMetresPerDegree;  // at least the true one
      const int steps = static_cast<int>(std::min(1000.0, std::ceil(length_m / kStep_m)));
      for (int k = 1; k < steps; ++k) add(a + (b - a) * k / steps);
    }
  }
  if (count == 0) return std::nullopt;
  ground.mean_z = sum / static_cast<double>(count);
  return ground;
}

void append_ground(city::Mesh& mesh, const MapFrame& map_frame, const Terrain* terrain,
                   const Eigen::AlignedBox2d& enu_bounds, double terrain_spacing_m) {
  const std::size_t first_vertex = mesh.vertices.size();
  if (terrain != nullptr) {
    const Eigen::Vector2d posts = enu_bounds.sizes() / terrain_spacing_m;
    if (posts.x() * posts.y() > kMostPosts) {
      throw InputError(
          fmt::format("the terrain would have {:.0f} million posts", posts.x() * posts.y() / 1e6),
          "give a wider spacing or a smaller box (at most 25 million posts)");
    }
    terrain->append(mesh, map_frame.frame(), enu_bounds.min(), enu_bounds.max(), terrain_spacing_m);
  } else {
    append_flat_sheet(mesh, map_frame.frame(), enu_bounds);
  }
  if (map_frame.grid() == Grid::Enu) return;
  for (std::size_t i = first_vertex; i < mesh.vertices.size(); ++i) {
    mesh.vertices[i] = map_frame.mesh_from_enu(mesh.vertices[i]);
  }
}

}  // namespace canyon::buildings
