#include "canyon/city/buildings/sources/terrain.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/buildings/sources/raster.hpp"
#include "canyon/city/city.hpp"

namespace canyon::buildings {
namespace {

constexpr double kMaxPosts = 25e6;

/// Height of a triangle's plane at a position inside it; empty outside.
std::optional<double> height_in(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                                const LonLat& point) {
  const LonLat ab = (b - a).head<2>(), ac = (c - a).head<2>(), ap = point - a.head<2>();
  const double twice = ab.x() * ac.y() - ab.y() * ac.x();
  if (twice == 0) return std::nullopt;
  constexpr double kEdge = 1e-9;  // neighbours leave no gap
  const double second = (ap.x() * ac.y() - ap.y() * ac.x()) / twice;
  const double third = (ab.x() * ap.y() - ab.y() * ap.x()) / twice;
  if (second < -kEdge || third < -kEdge || second + third > 1 + kEdge) return std::nullopt;
  return a.z() + second * (b.z() - a.z()) + third * (c.z() - a.z());
}

}  // namespace

struct Terrain::Impl {
  std::vector<Raster> rasters;
  std::optional<Tin> relief;
  ReadReport notes;
};

Terrain::Terrain(const std::vector<std::filesystem::path>& rasters, TerrainOptions options)
    : impl_(std::make_unique<Impl>()) {
  options.validate();
  if (rasters.empty()) throw InputError("no height raster is given", "name at least one file");
  for (const auto& path : rasters) impl_->rasters.emplace_back(path, options);
}
Terrain::Terrain(std::unique_ptr<Impl> impl, const std::string& note) : impl_(std::move(impl)) {
  impl_->notes.add_line(ReadReport::Level::Remark, note);
}

Terrain Terrain::from_relief(const std::vector<MapSurface>& relief) {
  auto impl = std::make_unique<Impl>();
  impl->relief.emplace(relief);
  const std::string note =
      fmt::format("ground from the relief of the city model, {} triangles", impl->relief->size());
  return {std::move(impl), note};
}
Terrain::~Terrain() = default;
Terrain::Terrain(Terrain&&) noexcept = default;

ReadReport Terrain::notes() const {
  ReadReport notes = impl_->notes;
  for (const Raster& raster : impl_->rasters) notes.append(raster.notes());
  return notes;
}

std::optional<double> Terrain::height_m(const LonLat& point) const {
  if (impl_->relief) return impl_->relief->height_m(point);
  for (const Raster& raster : impl_->rasters)
    if (const auto height = raster.height_m(point)) return height;
  return std::nullopt;
}

std::optional<double> Terrain::geoid_undulation_m(const LonLat& point) const {
  for (const Raster& raster : impl_->rasters)
    if (raster.height_m(point)) return raster.geoid_undulation_m(point);
  return std::nullopt;
}

std::optional<double> Terrain::local_height_m(const geodesy::LocalFrame& frame,
                                              const Eigen::Vector2d& point) const {
  // Away from the origin the frame's vertical is tilted against the ellipsoid's normal (1.6 mrad at 10 km):
  // the map position depends on z. A fixed-point iteration, whose error falls by tilt * slope in each step.
  double z = 0;
  for (int step = 0; step < 50; ++step) {
    const geodesy::Geodetic at = frame.geodetic_from_local({point.x(), point.y(), z});
    const auto height = height_m({geodesy::degrees(at.longitude_rad), geodesy::degrees(at.latitude_rad)});
    if (!height) return std::nullopt;
    const double change = *height - at.height_m;
    z += change;
    if (std::abs(change) < 1e-4) break;
  }
  return z;
}

void Terrain::append(city::Mesh& mesh, const geodesy::LocalFrame& frame, const Eigen::Vector2d& min,
                     const Eigen::Vector2d& max, double spacing_m) const {
  if (impl_->relief) {
    impl_->relief->append(mesh, frame, min, max);
    return;
  }
  const Eigen::Vector2d size = max - min;
  if (!size.allFinite() || !(size.minCoeff() > 0))
    throw InputError("the terrain's box is empty", "give min below max in east and north");
  if (!(spacing_m > 0) || !((size.x() / spacing_m + 1) * (size.y() / spacing_m + 1) <= kMaxPosts)) {
    throw InputError(fmt::format("terrain posts {} m apart over {:.0f} m x {:.0f} m are too many", spacing_m,
                                 size.x(), size.y()),
                     "choose a larger spacing or a smaller box (at most 25 million posts)");
  }
  std::size_t missing = 0, posts = 0;
  city::Mesh sheet;
  append_sheet(sheet, min, max, spacing_m, [&](const Eigen::Vector2d& point) {
    const auto z = local_height_m(frame, point);
    missing += z ? 0 : 1;
    ++posts;
    return z.value_or(0);
  });
  if (missing > 0) {
    const double fraction = 100.0 * static_cast<double>(posts - missing) / static_cast<double>(posts);
    const Eigen::Vector2d middle = 0.5 * (min + max);
    const geodesy::Geodetic at = frame.geodetic_from_local({middle.x(), middle.y(), 0});
    throw InputError(
        fmt::format(
            "the height rasters cover {:.1f} % of the city's ground ({:.0f} m x {:.0f} m about longitude "
            "{:.5f}, latitude {:.5f}); the rest is outside or no-data",
            fraction, size.x(), size.y(), geodesy::degrees(at.longitude_rad),
            geodesy::degrees(at.latitude_rad)),
        "add rasters that cover it, fill their holes, or reduce the terrain's margin");
  }
  city::append_object(mesh, "terrain", city::Surface::Terrain, city::Material::Ground, sheet.vertices,
                      sheet.triangles);
}

void append_sheet(city::Mesh& mesh, const Eigen::Vector2d& min, const Eigen::Vector2d& max, double spacing_m,
                  const std::function<double(const Eigen::Vector2d&)>& z) {
  const Eigen::Vector2d size = max - min;
  const auto columns = static_cast<std::uint32_t>(std::max(1.0, std::ceil(size.x() / spacing_m - 1e-9)));
  const auto rows = static_cast<std::uint32_t>(std::max(1.0, std::ceil(size.y() / spacing_m - 1e-9)));
  std::vector<Eigen::Vector3d> posts;
  posts.reserve(std::size_t{columns + 1} * (rows + 1));
  std::vector<std::array<std::uint32_t, 3>> triangles;
  triangles.reserve(std::size_t{columns} * rows * 2);
  for (std::uint32_t j = 0; j <= rows; ++j) {
    for (std::uint32_t i = 0; i <= columns; ++i) {
      const Eigen::Vector2d point(min.x() + size.x() * i / columns, min.y() + size.y() * j / rows);
      posts.emplace_back(point.x(), point.y(), z(point));
      if (i == columns || j == rows) continue;
      const std::uint32_t a = j * (columns + 1) + i;  // south-west
      const std::uint32_t b = a + 1, c = a + columns + 1, d = c + 1;
      triangles.push_back({a, b, d});
      triangles.push_back({a, d, c});
    }
  }
  city::append_object(mesh, "terrain", city::Surface::Terrain, city::Material::Ground, posts, triangles);
}

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
    for (std::size_t y = low[1]; y <= high[1]; ++y)
      for (std::size_t x = low[0]; x <= high[0]; ++x) triangles_of_cell_[y * side + x].push_back(t);
  }
}

std::array<std::size_t, 2> Tin::cell_of(const LonLat& point) const {
  std::array<std::size_t, 2> cell{};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    const double size = bounds_.sizes()[k];
    const double fraction = size > 0 ? (point[k] - bounds_.min()[k]) / size : 0;
    const auto count = static_cast<double>(cells_[axis]);
    cell[axis] = static_cast<std::size_t>(std::clamp(fraction * count, 0.0, count - 1));
  }
  return cell;
}

std::optional<double> Tin::height_m(const LonLat& point) const {
  if (triangles_.empty()) return std::nullopt;
  const LonLat near(longitude_near(point.x(), bounds_.center().x()), point.y());
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

double Tin::height_of_nearest_m(const LonLat& point) const {
  const auto cell = cell_of(point);
  double nearest = std::numeric_limits<double>::infinity(), height = 0;
  // Growing squares of cells around the position; one more after the first with corners.
  bool found = false;
  for (std::size_t ring = 0, last = cells_[0]; ring <= last; ++ring) {
    const bool before = found;
    const auto low = [&](std::size_t k) { return cell[k] >= ring ? cell[k] - ring : 0; };
    const auto high = [&](std::size_t k) { return std::min(cell[k] + ring, cells_[k] - 1); };
    for (std::size_t y = low(1); y <= high(1); ++y) {
      for (std::size_t x = low(0); x <= high(0); ++x) {
        for (const std::uint32_t t : triangles_of_cell_[y * cells_[0] + x]) {
          for (const std::uint32_t i : triangles_[t]) {
            const double away = (vertices_[i].head<2>() - point).squaredNorm();
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
