#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/studies/heatmap/engine/engine.hpp"

namespace canyon::heatmap {

/// A finished map as writers see it: values are read back tile by tile, never all at once.
struct MapSource {
  const Request* request = nullptr;    ///< not null
  geodesy::LocalFrame frame;           ///< of the city
  std::string title, history, source;  ///< CF attributes; no date, so that equal runs give equal bytes
  std::map<std::string, std::string> attributes;  ///< further global ones: model, receiver, systems, seed
  std::string over_runs;                          ///< CF cell method over several maps, "mean"; empty: of one
  /// Values of one tile at one time, layout [layer][altitude][cell], and the states [altitude][cell]. Empty:
  /// not computed (an interrupted run): written as missing.
  struct Slice {
    std::vector<float> values;
    std::vector<CellState> state;
  };
  /// Must be set. Each writer asks once for each pair, in the writer's own thread: write_netcdf() tile by
  /// tile with all its times, write_geotiffs() time by time. Its exceptions pass through the writer.
  using Slices = std::function<std::optional<Slice>(std::size_t tile, std::size_t time)>;
  Slices slice;
  /// May be empty. Steps done and in all: rises from the first step on, ends with both equal. From the
  /// writer's own thread.
  std::function<void(std::size_t, std::size_t)> progress;
};

/// Scale of the map's plane at the origin: 1 + h / R with h the origin's height above the ellipsoid and
/// R = sqrt(M N) = a sqrt(1 - e^2) / (1 - e^2 sin^2 latitude), the Gaussian radius (Snyder, Map Projections,
/// USGS Professional Paper 1395, 1987, eq. 4-18 and 4-20): the city's metres are those at its height.
[[nodiscard]] double projection_scale(const geodesy::LocalFrame& frame);

/// PROJ string of the map's plane, x and y as the city's: Transverse Mercator about the city's origin with
/// projection_scale(), or, for a frame with a heading, the Hotine Oblique Mercator (variant B, EPSG method
/// 9815) whose grid is turned likewise. Points at the origin's height lie within 9 mm of the city's x and y
/// up to 10 km from the origin, and 0.6 mm more for each 100 m that the origin is above the ellipsoid; the
/// distance grows with its cube. A point dz above or below that plane lies another dz distance / 6371 km off:
/// its plumb line is not the city's z. |latitude| of the origin below 89.9 deg for frames with a heading.
[[nodiscard]] std::string projection(const geodesy::LocalFrame& frame);

/// One NetCDF-4 file, CF-1.10: variables (time, altitude, y, x), `cell_state` (altitude, y, x), grid mapping,
/// coordinates in metres and bounds, chunked by tile, compressed; up to 4 million cells latitude and
/// longitude of each as well. Times are UTC. Equal sources give equal bytes. docs/heatmap.md describes
/// it. Written whole or not at all; memory: one slice and 1 MiB for each layer. Throws InputError where the
/// folder or the disk does not take it. Part of canyon::io.
void write_netcdf(const std::filesystem::path& path, const MapSource& source);

/// One Cloud Optimized GeoTIFF for each layer, altitude and time, `NAME[_aALTm][_tYYYYmmddTHHMMSSZ].tif` in
/// `folder` (parts that do not vary are left out); NaN is nodata, north up, band description and unit set.
/// Times with a fraction of a second show it, "_t20190428T125803.5Z". The folder is made where needed. All
/// files appear at the end, or none; until then the folder holds uncompressed values of one time as well.
/// Memory: one slice and GDAL's cache (GDAL_CACHEMAX). Returns the names, by time, altitude and layer. Throws
/// like write_netcdf(). Part of canyon::io.
std::vector<std::string> write_geotiffs(const std::filesystem::path& folder, const MapSource& source);
/// Their names, by time, layer and altitude. Part of canyon::io.
[[nodiscard]] std::vector<std::string> geotiff_names(const Request& request);

/// Pictures: for each time, altitude and sheet of at most six layers
/// `map[_SHEET][_aALTm][_tYYYYmmddTHHMMSSZ].png` with a panel for each layer, city outlines, colour bars with
/// units, scale, north; SHEET counts from 1 where there are several, parts that do not vary are left out.
/// Returns the names by time, altitude and sheet. Each file appears whole or not at all.
///
/// A layer has the same colours on all pictures, readable by colour-blind people: see make_colour_scale(). A
/// pixel that covers several cells has the mean of their values where at least half of them have one, else it
/// shows what most of them are; a pixel of a count shows the class that the mean, rounded, is in. Quantiles
/// are those of the pixels. Times whose values do not fit into 256 MB are asked for twice. Memory: that, one
/// slice, and, with p pixels on a map (at most 1200 x 1920 of a single layer, 572 x 916 of three), about 13 p
/// bytes for each layer and altitude. Equal sources give equal bytes on one machine (fonts are the system's).
/// @param city whose buildings are outlined; a pixel's building need not reach the map's altitude
/// Throws InputError where the folder or the disk does not take it. Part of canyon::io.
std::vector<std::string> write_map_pictures(const std::filesystem::path& folder, const MapSource& source,
                                            const city::City& city);

/// A map read back from write_netcdf()'s file, for questions of route planners. Tiles are read when they are
/// asked for, the last ones kept (64 MiB). Thread-safe (one thread reads at a time). Part of canyon::io.
class StoredMap {
 public:
  /// Throws InputError for a file that is missing, damaged or not a map of Canyon.
  explicit StoredMap(const std::filesystem::path& netcdf);
  ~StoredMap();
  StoredMap(StoredMap&&) noexcept;

  [[nodiscard]] const Grid& grid() const { return about_->grid; }
  [[nodiscard]] const geodesy::LocalFrame& frame() const { return about_->frame; }
  [[nodiscard]] const std::vector<geodesy::GpsTime>& times() const { return about_->times; }
  [[nodiscard]] const std::vector<double>& altitudes_m() const { return about_->altitudes_m; }
  [[nodiscard]] AltitudeKind altitude_kind() const { return about_->altitude_kind; }
  [[nodiscard]] const std::vector<Layer>& layers() const { return about_->layers; }
  /// The motion of the receiver: simulation::describe(), "standing" where the file does not say.
  [[nodiscard]] const std::string& motion() const { return about_->motion; }
  struct Answer {
    std::vector<float> values;  ///< one for each layer; NaN: none there
    CellState state = CellState::Computed;
    geodesy::GpsTime time;  ///< of the map, nearest to the asked one
    double altitude_m = 0;  ///< likewise
  };
  /// At the cell that a place lies in (a side belongs to the cell east or north of it, the outermost sides to
  /// the grid), the nearest altitude and time (ties: the earlier, the lower). Empty outside the grid, and
  /// before the first or after the last time by more than half the step next to it (a single time: 15 min).
  /// Cells that were not computed have NaN values. Throws InputError for a damaged tile.
  [[nodiscard]] std::optional<Answer> at(const Eigen::Vector2d& enu, double altitude_m,
                                         geodesy::GpsTime time) const;

 private:
  struct About {
    Grid grid;
    geodesy::LocalFrame frame;
    std::vector<geodesy::GpsTime> times;
    std::vector<double> altitudes_m;
    AltitudeKind altitude_kind = AltitudeKind::AboveTerrain;
    std::vector<Layer> layers;
    std::string motion;
  };
  struct Impl;
  std::unique_ptr<Impl> impl_;
  const About* about_;  ///< of *impl_
};

/// MapSource::slice of a map whose tiles stand in a store: empty for units that it does not have. Keeps the
/// unit read last, for writers that take all times of a tile. Both must outlive it. Not thread-safe. Throws
/// as TileStore::load() does.
[[nodiscard]] MapSource::Slices store_slices(const Heatmap& heatmap, const TileStore& store);

/// The statistic over several maps, cell by cell: the value that this share of the runs [0, 1] reach or are
/// better than, which is that quantile, or one less it of layers where more is better, of a further run
/// (predictive_quantile()). Empty: the mean.
using OverRuns = std::optional<double>;
/// MapSource::slice over maps of one request that differ in their seed, each a slice of its own: over the
/// runs that have a value there; states are the first run's that computed the cell, else the first's. Empty
/// where any of them is. Memory: a slice of each run.
[[nodiscard]] MapSource::Slices slices_over_runs(std::vector<MapSource::Slices> runs,
                                                 std::vector<Layer> layers, OverRuns what);

/// The whole map as writers see it: store_slices(), and a description of it. The caller sets `history`.
/// `scenario` is the one that `environment` was made of, for the names of what was computed. All must outlive
/// it. Not thread-safe.
[[nodiscard]] MapSource map_source(const Heatmap& heatmap, const TileStore& store,
                                   const simulation::Environment& environment,
                                   const simulation::ReceiverConfig& receiver,
                                   const simulation::Scenario& scenario);

}  // namespace canyon::heatmap
