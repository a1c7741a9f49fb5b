#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>

#include "canyon/analysis/heatmap/engine/map_source.hpp"

namespace canyon::heatmap {

/// A map read from write_netcdf()'s file, for queries of route planners. Tiles are read on demand, the last
/// ones cached (64 MiB). Thread-safe (one thread reads at a time). Part of canyon::io.
class StoredMap final : public MapReader {
 public:
  /// Throws InputError for a file that is missing, damaged or not a map of Canyon.
  explicit StoredMap(const std::filesystem::path& netcdf);
  ~StoredMap() override;
  StoredMap(StoredMap&&) noexcept;

  [[nodiscard]] const MapInfo& about() const override;
  /// Throws InputError for a damaged tile.
  [[nodiscard]] std::optional<MapSample> at(const Eigen::Vector2d& enu, double altitude_m,
                                            geodesy::GpsTime time) const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::heatmap
