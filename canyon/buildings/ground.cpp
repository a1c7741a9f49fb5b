// Declared in canyon/buildings/builder_steps.hpp.
#include "canyon/buildings/builder_steps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"

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

Eigen::Vector3d MapFrame::mesh_from_map(const LonLat& place, double height_m) const {
  return frame_.local_from_geodetic(geodesy::Geodetic::from_degrees(place.y(), place.x(), height_m));
}

Eigen::Vector3d MapFrame::map_from_mesh(const Eigen::Vector3d& point) const {
  const geodesy::Geodetic place = frame_.geodetic_from_local(point);
  return {geodesy::degrees(place.longitude_rad), geodesy::degrees(place.latitude_rad), place.height_m};
}

std::optional<double> MapFrame::ground_height_m(const LonLat& place) const {
  if (terrain_ == nullptr) return frame_.origin().height_m;
  return terrain_->height_m(place);
}

std::optional<Eigen::Vector3d> MapFrame::ground(const LonLat& place) const {
  const std::optional<double> height = ground_height_m(place);
  if (!height) return std::nullopt;
  return mesh_from_map(place, *height);
}

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

void append_ground(city::Mesh& mesh, const geodesy::LocalFrame& frame, const Terrain* terrain,
                   const Eigen::AlignedBox2d& bounds, double terrain_spacing_m) {
  if (terrain == nullptr) {
    append_flat_sheet(mesh, frame, bounds);
    return;
  }
  const Eigen::Vector2d posts = bounds.sizes() / terrain_spacing_m;
  if (posts.x() * posts.y() > kMostPosts) {
    throw InputError(fmt::format("the terrain would have {:.0f} million posts", posts.x() * posts.y() / 1e6),
                     "give a wider spacing or a smaller box (at most 25 million posts)");
  }
  terrain->append(mesh, frame, bounds.min(), bounds.max(), terrain_spacing_m);
}

}  // namespace canyon::buildings
