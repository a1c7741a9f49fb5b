#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "canyon/city/buildings/sources/map_data.hpp"
#include "canyon/city/buildings/sources/terrain.hpp"

namespace canyon::buildings {

/// The heights of a raster, from at most 256 x 256 of its posts.
struct RasterSummary {
  int columns = 0, rows = 0;
  double spacing_m = 0;          ///< between neighbouring posts, the smaller of the two
  std::optional<LonLat> middle;  ///< longitude and latitude [deg]; empty where the projection does not say it
  std::optional<double> lowest_m, highest_m;  ///< as in the file, without fill values; empty without a height
  double empty_share = 0;  ///< of posts without data, and of those beyond -500 to 9,000 m: [0, 1]
};

/// One height raster behind GDAL: band 1, in any projection. Any thread may ask; blocks are read when they
/// are needed and kept in GDAL's block cache (GDAL_CACHEMAX bounds it).
class Raster {
 public:
  /// Throws InputError as Terrain does.
  Raster(const std::filesystem::path& path, const TerrainOptions& options);
  ~Raster();
  Raster(Raster&&) noexcept;

  /// Ellipsoidal height [m] at longitude and latitude [deg]: bilinear between pixel centres, constant over
  /// the outermost half pixel. Empty outside the raster and where one of the pixels that count is no-data.
  /// A pixel beyond -500 to 9,000 m is not ground: it counts as the mean of those around it. Throws
  /// InputError for a damaged file.
  [[nodiscard]] std::optional<double> height_m(const LonLat& place) const;
  /// Where height_m() answers: ellipsoidal height of mean sea level [m]; empty where heights are ellipsoidal.
  [[nodiscard]] std::optional<double> geoid_undulation_m(const LonLat& place) const;
  /// Which geoid was added and why, or that heights are taken as ellipsoidal; and such pixels among those
  /// that were asked for.
  [[nodiscard]] ReadReport notes() const;
  [[nodiscard]] RasterSummary summary() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::buildings
