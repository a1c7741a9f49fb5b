#pragma once

#include <filesystem>

#include "canyon/analysis/heatmap/kernels/grid.hpp"
#include "canyon/base/geodesy/frames.hpp"

namespace canyon::heatmap {

/// Polygon and MultiPolygon features of a GeoJSON file (longitude, latitude). Throws InputError with file and
/// hint. Part of canyon::io.
[[nodiscard]] Area read_area(const std::filesystem::path& geojson, const geodesy::LocalFrame& frame);

}  // namespace canyon::heatmap
