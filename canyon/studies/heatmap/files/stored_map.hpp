#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/studies/heatmap/engine/map_source.hpp"

namespace canyon::heatmap {

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
  /// At the cell that a place lies in (a side belongs to the cell east or north of it, the outermost sides to
  /// the grid), the nearest altitude and time (ties: the earlier, the lower). Empty outside the grid, and
  /// before the first or after the last time by more than half the step next to it (a single time: 15 min).
  /// Cells that were not computed have NaN values. Throws InputError for a damaged tile.
  [[nodiscard]] std::optional<MapAnswer> at(const Eigen::Vector2d& enu, double altitude_m,
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

}  // namespace canyon::heatmap
