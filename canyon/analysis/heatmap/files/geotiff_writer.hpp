#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "canyon/analysis/heatmap/engine/map_source.hpp"

namespace canyon::heatmap {

/// One Cloud Optimized GeoTIFF for each layer, altitude and time, `NAME[_aALTm][_tYYYYmmddTHHMMSSZ].tif` in
/// `folder` (parts that do not vary are left out); NaN is nodata, north up, band description and unit set.
/// Times with a fraction of a second include it, "_t20190428T125803.5Z". The folder is created if needed. All
/// files appear at the end, or none; until then the folder also holds uncompressed values of one time.
/// Memory: one slice and GDAL's cache (GDAL_CACHEMAX). Returns the names, by time, altitude and layer. Throws
/// like write_netcdf(). Part of canyon::io.
std::vector<std::string> write_geotiffs(const std::filesystem::path& folder, const MapSource& source);
/// Their names, by time, layer and altitude. Part of canyon::io.
[[nodiscard]] std::vector<std::string> geotiff_names(const Request& request);

}  // namespace canyon::heatmap
