#include "canyon/city/buildings/sources/terrain.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/buildings/sources/raster.hpp"
#include "canyon/city/buildings/sources/tin.hpp"
#include "canyon/city/city.hpp"

namespace canyon::buildings {
namespace {

constexpr double kMostPosts = 25e6;

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
  impl_->notes.say(ReadReport::Level::Remark, note);
}

Terrain Terrain::of_relief(const std::vector<MapSurface>& relief) {
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

std::optional<double> Terrain::height_m(const LonLat& place) const {
  if (impl_->relief) return impl_->relief->height_m(place);
  for (const Raster& raster : impl_->rasters) {
    if (const auto height = raster.height_m(place)) return height;
  }
  return std::nullopt;
}

std::optional<double> Terrain::geoid_undulation_m(const LonLat& place) const {
  for (const Raster& raster : impl_->rasters) {
    if (raster.height_m(place)) return raster.geoid_undulation_m(place);
  }
  return std::nullopt;
}

std::optional<double> Terrain::local_height_m(const geodesy::LocalFrame& frame,
                                              const Eigen::Vector2d& place) const {
  // Away from the origin the frame's vertical leans from the ellipsoid's normal (1.6 mrad at 10 km), so that
  // the place on the map depends on z: a fixed point that gains a factor lean * slope in each step.
  double z = 0;
  for (int step = 0; step < 50; ++step) {
    const geodesy::Geodetic at = frame.geodetic_from_local({place.x(), place.y(), z});
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
  if (!size.allFinite() || !(size.minCoeff() > 0)) {
    throw InputError("the terrain's box is empty", "give min below max in east and north");
  }
  if (!(spacing_m > 0) || !((size.x() / spacing_m + 1) * (size.y() / spacing_m + 1) <= kMostPosts)) {
    throw InputError(fmt::format("terrain posts {} m apart over {:.0f} m x {:.0f} m are too many", spacing_m,
                                 size.x(), size.y()),
                     "choose a larger spacing or a smaller box (at most 25 million posts)");
  }
  std::size_t missing = 0, posts = 0;
  city::Mesh sheet;
  append_sheet(sheet, min, max, spacing_m, [&](const Eigen::Vector2d& place) {
    const auto z = local_height_m(frame, place);
    missing += z ? 0 : 1;
    ++posts;
    return z.value_or(0);
  });
  if (missing > 0) {
    const double share = 100.0 * static_cast<double>(posts - missing) / static_cast<double>(posts);
    const Eigen::Vector2d middle = 0.5 * (min + max);
    const geodesy::Geodetic at = frame.geodetic_from_local({middle.x(), middle.y(), 0});
    throw InputError(
        fmt::format(
            "the height rasters cover {:.1f} % of the city's ground ({:.0f} m x {:.0f} m about longitude "
            "{:.5f}, latitude {:.5f}); the rest is outside or no-data",
            share, size.x(), size.y(), geodesy::degrees(at.longitude_rad), geodesy::degrees(at.latitude_rad)),
        "add rasters that cover it, fill their holes, or lessen the terrain's margin");
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
      const Eigen::Vector2d place(min.x() + size.x() * i / columns, min.y() + size.y() * j / rows);
      posts.emplace_back(place.x(), place.y(), z(place));
      if (i == columns || j == rows) continue;
      const std::uint32_t a = j * (columns + 1) + i;  // south-west
      const std::uint32_t b = a + 1, c = a + columns + 1, d = c + 1;
      triangles.push_back({a, b, d});
      triangles.push_back({a, d, c});
    }
  }
  city::append_object(mesh, "terrain", city::Surface::Terrain, city::Material::Ground, posts, triangles);
}

}  // namespace canyon::buildings
