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
  double spacing_m = 0;          ///< between neighbouring posts, the smaller of both directions
  std::optional<LonLat> middle;  ///< longitude and latitude [deg]; empty if the projection cannot convert it
  std::optional<double> lowest_m, highest_m;  ///< as in the file, without fill values; empty without a height
  double empty_fraction = 0;  ///< fraction of posts without data or outside -500 to 9,000 m: [0, 1]
};

/// One height raster read by GDAL: band 1, in any projection. Thread-safe; blocks are read on demand and kept
/// in GDAL's block cache (bounded by GDAL_CACHEMAX).
class Raster {
 public:
  /// Throws InputError as Terrain does.
  Raster(const std::filesystem::path& path, const TerrainOptions& options);
  ~Raster();
  Raster(Raster&&) noexcept;

  /// Ellipsoidal height [m] at longitude and latitude [deg]: bilinear between pixel centres, constant over
  /// the outermost half pixel. Empty outside the raster or if a pixel is no-data. A pixel outside -500 to
  /// 9,000 m is not ground: it is replaced by the mean of its neighbours. Throws InputError for a damaged
  /// file.
  [[nodiscard]] std::optional<double> height_m(const LonLat& point) const;
  /// If height_m() has a value: ellipsoidal height of mean sea level [m]; empty if heights are ellipsoidal.
  [[nodiscard]] std::optional<double> geoid_undulation_m(const LonLat& point) const;
  /// Which geoid was added and why, or that heights are read as ellipsoidal; and replaced pixels in use.
  [[nodiscard]] ReadReport notes() const;
  [[nodiscard]] RasterSummary summary() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::buildings
