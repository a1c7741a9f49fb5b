#pragma once

#include <string>

#include "canyon/geodesy/frames.hpp"

namespace canyon::heatmap {

/// projection()'s system, named, on the geographic system EPSG:4326, as WKT for GDAL's `format`: "WKT2",
/// "WKT1_GDAL". Throws InputError where PROJ does not take it (proj.db missing). Part of canyon::io.
[[nodiscard]] std::string projection_wkt(const geodesy::LocalFrame& frame, const std::string& format);

}  // namespace canyon::heatmap
