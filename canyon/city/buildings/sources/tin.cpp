#include "canyon/city/buildings/sources/tin.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "canyon/city/city.hpp"

namespace canyon::buildings {
namespace {

/// Height of a triangle's plane at a place inside of it; empty outside.
std::optional<double> height_in(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                                const LonLat& place) {
  const LonLat ab = (b - a).head<2>(), ac = (c - a).head<2>(), ap = place - a.head<2>();
  const double twice = ab.x() * ac.y() - ab.y() * ac.x();
  if (twice == 0) return std::nullopt;
  constexpr double kEdge = 1e-9;  // neighbours leave no gap
  const double second = (ap.x() * ac.y() - ap.y() * ac.x()) / twice;
  const double third = (ab.x() * ap.y() - ab.y() * ap.x()) / twice;
  if (second < -kEdge || third < -kEdge || second + third > 1 + kEdge) return std::nullopt;
  return a.z() + second * (b.z() - a.z()) + third * (c.z() - a.z());
}

}  // namespace

Tin::Tin(const std::vector<MapSurface>& surfaces) {
  std::map<std::array<double, 3>, std::uint32_t> index;
  const auto vertex = [&](const Eigen::Vector3d& p) {
    const auto [found, added] =
        index.emplace(std::array{p.x(), p.y(), p.z()}, static_cast<std::uint32_t>(vertices_.size()));
    if (added) {
      vertices_.push_back(p);
      bounds_.extend(LonLat(p.head<2>()));
    }
    return found->second;
  };
  for (const MapSurface& surface : surfaces) {
    for (std::size_t i = 2; i < surface.outer.size(); ++i)
      triangles_.push_back(
          {vertex(surface.outer[0]), vertex(surface.outer[i - 1]), vertex(surface.outer[i])});
  }
  const auto side = static_cast<std::size_t>(std::sqrt(static_cast<double>(triangles_.size()) / 2)) + 1;
  cells_ = {side, side};
  triangles_of_cell_.resize(side * side);
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    Eigen::AlignedBox2d box;
    for (const std::uint32_t i : triangles_[t]) box.extend(LonLat(vertices_[i].head<2>()));
    const auto low = cell_of(box.min()), high = cell_of(box.max());
    for (std::size_t y = low[1]; y <= high[1]; ++y) {
      for (std::size_t x = low[0]; x <= high[0]; ++x) triangles_of_cell_[y * side + x].push_back(t);
    }
  }
}

std::array<std::size_t, 2> Tin::cell_of(const LonLat& place) const {
  std::array<std::size_t, 2> cell{};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    const double size = bounds_.sizes()[k];
    const double share = size > 0 ? (place[k] - bounds_.min()[k]) / size : 0;
    const auto count = static_cast<double>(cells_[axis]);
    cell[axis] = static_cast<std::size_t>(std::clamp(share * count, 0.0, count - 1));
  }
  return cell;
}

std::optional<double> Tin::height_m(const LonLat& place) const {
  if (triangles_.empty()) return std::nullopt;
  const LonLat near(longitude_near(place.x(), bounds_.center().x()), place.y());
  if (!bounds_.contains(near)) return std::nullopt;
  const auto [x, y] = cell_of(near);
  std::optional<double> highest;
  for (const std::uint32_t t : triangles_of_cell_[y * cells_[0] + x]) {
    const auto& [a, b, c] = triangles_[t];
    const auto height = height_in(vertices_[a], vertices_[b], vertices_[c], near);
    if (height && (!highest || *height > *highest)) highest = height;
  }
  return highest ? *highest : height_of_nearest_m(near);
}

double Tin::height_of_nearest_m(const LonLat& place) const {
  const auto cell = cell_of(place);
  double nearest = std::numeric_limits<double>::infinity(), height = 0;
  // Wider and wider squares of cells about the place; one more after the first that has corners.
  bool found = false;
  for (std::size_t ring = 0, last = cells_[0]; ring <= last; ++ring) {
    const bool before = found;
    const auto low = [&](std::size_t k) { return cell[k] >= ring ? cell[k] - ring : 0; };
    const auto high = [&](std::size_t k) { return std::min(cell[k] + ring, cells_[k] - 1); };
    for (std::size_t y = low(1); y <= high(1); ++y) {
      for (std::size_t x = low(0); x <= high(0); ++x) {
        for (const std::uint32_t t : triangles_of_cell_[y * cells_[0] + x]) {
          for (const std::uint32_t i : triangles_[t]) {
            const double away = (vertices_[i].head<2>() - place).squaredNorm();
            if (away < nearest) {
              nearest = away;
              height = vertices_[i].z();
            }
            found = true;
          }
        }
      }
    }
    if (found && !before) last = ring + 1;
  }
  return height;
}

void Tin::append(city::Mesh& mesh, const geodesy::LocalFrame& frame, const Eigen::Vector2d& min,
                 const Eigen::Vector2d& max) const {
  std::vector<Eigen::Vector3d> points;
  points.reserve(vertices_.size());
  for (const Eigen::Vector3d& p : vertices_)
    points.push_back(
        frame.local_from_geodetic(geodesy::Geodetic::from_degrees(p.y(), longitude_near(p.x(), 0), p.z())));
  const Eigen::AlignedBox2d area(min, max);
  std::vector<Corners> kept;
  for (Corners triangle : triangles_) {
    Eigen::AlignedBox2d box;
    for (const std::uint32_t i : triangle) box.extend(Eigen::Vector2d(points[i].head<2>()));
    if (!area.intersects(box)) continue;
    const Eigen::Vector3d &a = points[triangle[0]], &b = points[triangle[1]], &c = points[triangle[2]];
    if ((b - a).cross(c - a).z() < 0) std::swap(triangle[1], triangle[2]);
    kept.push_back(triangle);
  }
  city::append_object(mesh, "terrain", city::Surface::Terrain, city::Material::Ground, points, kept);
}

}  // namespace canyon::buildings
