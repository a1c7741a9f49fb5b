#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/buildings/sources/map_data.hpp"
#include "canyon/city/buildings/sources/map_options.hpp"
#include "canyon/city/fwd.hpp"

namespace canyon::buildings {

/// The ground: height rasters, read through GDAL (formats: see Raster), in any projection,
/// or the relief of a city model. Heights are ellipsoidal [m] after the geoid.
class Terrain {
 public:
  /// Opens rasters; the first that covers a position is used. Throws InputError: missing, not a raster, no
  /// georeference, no height band, a vertical datum without an installed grid or a given undulation.
  explicit Terrain(const std::vector<std::filesystem::path>& rasters, TerrainOptions options = {});
  /// The relief of a city model, MapData::relief.
  [[nodiscard]] static Terrain from_relief(const std::vector<MapSurface>& relief);
  ~Terrain();
  Terrain(Terrain&&) noexcept;

  /// Bilinear between pixel centres, linear in triangles; empty outside the rasters and on no-data.
  /// Thread-safe. Throws InputError for a damaged raster.
  [[nodiscard]] std::optional<double> height_m(const LonLat& point) const;
  /// z [m] at which the vertical line of `frame` through (x, y) [m] intersects the ground, to 0.1 mm;
  /// includes Earth's curvature. Empty likewise.
  [[nodiscard]] std::optional<double> local_height_m(const geodesy::LocalFrame& frame,
                                                     const Eigen::Vector2d& point) const;
  /// Ellipsoidal height of mean sea level [m], from the raster used at this position; empty if there is none,
  /// and if its heights are ellipsoidal or read as such.
  [[nodiscard]] std::optional<double> geoid_undulation_m(const LonLat& point) const;
  /// Which geoid was added and why, that heights are read as ellipsoidal, and implausible heights in use.
  [[nodiscard]] ReadReport notes() const;

  /// Appends a triangulated sheet over [min, max] (east, north [m]) of `frame`, posts at most `spacing_m`
  /// apart, as one object named "terrain". Throws InputError, with the covered fraction, if the rasters do
  /// not cover the box, and for a spacing that is not positive or needs more than 25 million posts. A relief
  /// is appended with its own triangles and may end inside the box. Between posts the sheet is flat: Earth's
  /// curvature adds spacing^2 / (8 R), 2 cm at 1 km.
  void append(city::Mesh& mesh, const geodesy::LocalFrame& frame, const Eigen::Vector2d& min,
              const Eigen::Vector2d& max, double spacing_m) const;

 private:
  struct Impl;
  Terrain(std::unique_ptr<Impl> impl, const std::string& note);
  std::unique_ptr<Impl> impl_;
};

/// Appends a sheet over [min, max] (east, north [m]), posts in equal steps of at most `spacing_m`, as one
/// object named "terrain". @param z of a post, by its position
void append_sheet(city::Mesh& mesh, const Eigen::Vector2d& min, const Eigen::Vector2d& max, double spacing_m,
                  const std::function<double(const Eigen::Vector2d&)>& z);

/// The ground as triangles (a city model's relief).
class Tin {
 public:
  /// Longitude, latitude [deg], ellipsoidal height [m]; polygons become fans, holes are ignored.
  explicit Tin(const std::vector<MapSurface>& surfaces);

  [[nodiscard]] std::size_t size() const { return triangles_.size(); }
  /// The height of the highest triangle at a position; in a gap (under a building) that of the nearest
  /// corner. Empty outside the triangles' bounds.
  [[nodiscard]] std::optional<double> height_m(const LonLat& point) const;
  /// Appends the triangles that overlap [min, max] (east, north [m]) of `frame`, front sides up, as one
  /// object named "terrain".
  void append(city::Mesh& mesh, const geodesy::LocalFrame& frame, const Eigen::Vector2d& min,
              const Eigen::Vector2d& max) const;

 private:
  using Corners = std::array<std::uint32_t, 3>;
  [[nodiscard]] std::array<std::size_t, 2> cell_of(const LonLat& point) const;
  [[nodiscard]] double height_of_nearest_m(const LonLat& point) const;

  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Corners> triangles_;
  Eigen::AlignedBox2d bounds_;
  std::array<std::size_t, 2> cells_{1, 1};
  std::vector<std::vector<std::uint32_t>> triangles_of_cell_;
};

}  // namespace canyon::buildings
