#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "canyon/heatmap/engine.hpp"

namespace canyon::heatmap {

/// A finished map as writers see it: values are read back tile by tile, never all at once.
struct MapSource {
  const Request* request = nullptr;    ///< not null
  geodesy::LocalFrame frame;           ///< of the city
  std::string title, history, source;  ///< CF attributes; no date, so that equal runs give equal bytes
  std::map<std::string, std::string> attributes;  ///< further global ones: model, receiver, systems, seed
  /// Values of one tile at one time, layout [layer][altitude][cell], and the states [altitude][cell]. Empty:
  /// not computed (an interrupted run): written as missing.
  struct Slice {
    std::vector<float> values;
    std::vector<CellState> state;
  };
  std::function<std::optional<Slice>(std::size_t tile, std::size_t time)> slice;
  std::function<void(std::size_t, std::size_t)> progress;
};

/// PROJ string of the map's plane: Transverse Mercator about the city's origin, scale 1: within 1 cm of the
/// city's east and north within 10 km of the origin.
[[nodiscard]] std::string projection(const geodesy::LocalFrame& frame);

/// One NetCDF-4 file, CF-1.10: variables (time, altitude, y, x), `cell_state`, grid mapping, coordinates in
/// metres and bounds, chunked by tile, compressed. Written whole or not at all. Part of canyon::io.
void write_netcdf(const std::filesystem::path& path, const MapSource& source);

/// One Cloud Optimized GeoTIFF for each layer, altitude and time, `NAME[_aALTm][_tYYYYmmddTHHMMSSZ].tif` in
/// `folder` (parts that do not vary are left out); NaN is nodata, north up, band description and unit set.
/// Returns the names. Part of canyon::io.
std::vector<std::string> write_geotiffs(const std::filesystem::path& folder, const MapSource& source);

/// Pictures: for each altitude and time `map[_a...][_t...].png` with a panel for each layer (at most six),
/// city outlines, colour bars with units, scale, north; with more than one time `map[_a...].apng`-like
/// animation as animated PNG. Readable by colour-blind people. Returns the names. Part of canyon::io.
std::vector<std::string> write_map_pictures(const std::filesystem::path& folder, const MapSource& source,
                                            const city::City& city);

/// A map read back from write_netcdf()'s file, for questions of route planners. Part of canyon::io.
class StoredMap {
 public:
  /// Throws InputError for a file that is missing, damaged or no map of Canyon's.
  explicit StoredMap(const std::filesystem::path& netcdf);
  ~StoredMap();

  [[nodiscard]] const Grid& grid() const;
  [[nodiscard]] const geodesy::LocalFrame& frame() const;
  [[nodiscard]] const std::vector<geodesy::GpsTime>& times() const;
  [[nodiscard]] const std::vector<double>& altitudes_m() const;
  [[nodiscard]] const std::vector<Layer>& layers() const;
  struct Answer {
    std::vector<float> values;  ///< one for each layer; NaN: none there
    CellState state = CellState::Computed;
    geodesy::GpsTime time;  ///< of the map, nearest to the asked one
    double altitude_m = 0;  ///< likewise
  };
  /// At the cell that a place lies in, the nearest altitude and time. Empty outside the grid, more than half
  /// a step (and 15 min for a single time) away from all times.
  [[nodiscard]] std::optional<Answer> at(const Eigen::Vector2d& enu, double altitude_m,
                                         geodesy::GpsTime time) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::heatmap
