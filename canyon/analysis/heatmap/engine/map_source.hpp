#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "canyon/analysis/heatmap/engine/engine.hpp"

namespace canyon::heatmap {

/// A finished map as the input of writers: values are read tile by tile, never all at once.
struct MapSource {
  const Request* request = nullptr;    ///< not null
  geodesy::LocalFrame frame;           ///< of the city
  std::string title, history, source;  ///< CF attributes; no date, so that equal runs give equal bytes
  std::map<std::string, std::string> attributes;  ///< further global ones: model, receiver, systems, seed
  std::string over_runs;  ///< CF cell method over several maps, "mean"; empty: one map
  /// Values of one tile at one time, layout [layer][altitude][cell], and the states [altitude][cell]. Empty:
  /// not computed (an interrupted run): written as missing.
  struct Slice {
    std::vector<float> values;
    std::vector<CellState> state;
  };
  /// Must be set. Each writer requests each pair once, on its own thread: write_netcdf() tile by
  /// tile with all its times, write_geotiffs() time by time. Its exceptions pass through the writer.
  using Slices = std::function<std::optional<Slice>(std::size_t tile, std::size_t time)>;
  Slices slice;
  /// May be empty. Steps done and in all, increasing until both are equal. On the writer's own thread.
  std::function<void(std::size_t, std::size_t)> progress;
};

/// Scale of the map's plane at the origin: 1 + h / R with h the origin's height above the ellipsoid and
/// R = sqrt(M N) = a sqrt(1 - e^2) / (1 - e^2 sin^2 latitude), the Gaussian radius (Snyder, Map Projections,
/// USGS Professional Paper 1395, 1987, eq. 4-18 and 4-20): the city's metres are those at its height.
[[nodiscard]] double projection_scale(const geodesy::LocalFrame& frame);

/// PROJ string of the map's plane, x and y as the city's: Transverse Mercator about the city's origin with
/// projection_scale(), or, for a frame with a heading, the Hotine Oblique Mercator (variant B, EPSG method
/// 9815) whose grid is rotated by it. Points at the origin's height are within 9 mm of the city's x and y up
/// to 10 km from the origin, and 0.6 mm more for each 100 m of the origin's height above the ellipsoid; the
/// deviation grows with the cube of the distance. A point dz above or below that plane deviates by another dz
/// distance / 6371 km: its plumb line is not the city's z. |latitude| of the origin below 89.9 deg for frames
/// with a heading.
[[nodiscard]] std::string projection(const geodesy::LocalFrame& frame);

/// Values of a finished map at a point and time.
struct MapSample {
  std::vector<float> values;  ///< one for each layer; NaN: no value
  CellState state = CellState::Computed;
  geodesy::GpsTime time;  ///< of the map, nearest to the requested one
  double altitude_m = 0;  ///< likewise
};

/// Reads values of a finished map at points: from a file, or in memory.
class MapReader {
 public:
  struct MapInfo {
    Grid grid;
    geodesy::LocalFrame frame;
    std::vector<geodesy::GpsTime> times;
    std::vector<double> altitudes_m;
    AltitudeKind altitude_kind = AltitudeKind::AboveTerrain;
    std::vector<Layer> layers;
    std::string motion;  ///< of the receiver: simulation::describe(), "standing" if not known
  };
  virtual ~MapReader() = default;

  [[nodiscard]] virtual const MapInfo& about() const = 0;
  [[nodiscard]] const Grid& grid() const { return about().grid; }
  [[nodiscard]] const geodesy::LocalFrame& frame() const { return about().frame; }
  [[nodiscard]] const std::vector<geodesy::GpsTime>& times() const { return about().times; }
  [[nodiscard]] const std::vector<double>& altitudes_m() const { return about().altitudes_m; }
  [[nodiscard]] AltitudeKind altitude_kind() const { return about().altitude_kind; }
  [[nodiscard]] const std::vector<Layer>& layers() const { return about().layers; }
  [[nodiscard]] const std::string& motion() const { return about().motion; }
  /// At the cell that contains a point (a side belongs to the cell east or north of it, the outermost sides
  /// to the grid), the nearest altitude and time (ties: the earlier, the lower). Empty outside the grid, and
  /// before the first or after the last time by more than half the step next to it (a single time: 15 min).
  /// Cells that were not computed have NaN values.
  [[nodiscard]] virtual std::optional<MapSample> at(const Eigen::Vector2d& enu, double altitude_m,
                                                    geodesy::GpsTime time) const = 0;
};

/// MapSource::slice of a map whose tiles are in a store: empty for missing units. Caches the last unit read,
/// for writers that read all times of a tile. Both must outlive it. Not thread-safe. Throws as
/// TileStore::load().
[[nodiscard]] MapSource::Slices store_slices(const Heatmap& heatmap, const TileStore& store);

/// The statistic over several maps, cell by cell: the value that this fraction of the runs [0, 1] reach or
/// are better than, which is that quantile (one minus it if more is better) of a further run
/// (predictive_quantile()). Empty: the mean.
using OverRuns = std::optional<double>;
/// MapSource::slice over maps of one request with different seeds, each given by its slices: over the runs
/// that have a value there; states are those of the first run that computed the cell, else the first's. Empty
/// if one of them is. Memory: a slice of each run.
[[nodiscard]] MapSource::Slices slices_over_runs(std::vector<MapSource::Slices> runs,
                                                 std::vector<Layer> layers, OverRuns what);

/// The whole map as the input of writers: store_slices(), and a description. The caller sets `history`.
/// `scenario` is the one from which `environment` was made; its names go into the description. All must
/// outlive it. Not thread-safe.
[[nodiscard]] MapSource map_source(const Heatmap& heatmap, const TileStore& store,
                                   const simulation::Environment& environment,
                                   const simulation::ReceiverConfig& receiver,
                                   const simulation::Scenario& scenario);

}  // namespace canyon::heatmap
