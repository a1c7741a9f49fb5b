#pragma once

#include <filesystem>

#include "canyon/analysis/heatmap/engine/map_source.hpp"

namespace canyon::heatmap {

/// One NetCDF-4 file, CF-1.10: variables (time, altitude, y, x), `cell_state` (altitude, y, x), grid mapping,
/// coordinates in metres and bounds, chunked by tile, compressed; for up to 4 million cells also the latitude
/// and longitude of each. Times are UTC. Equal sources give equal bytes. docs/heatmap.md describes it.
/// Written completely or not at all; memory: one slice and 1 MiB for each layer. Throws InputError if the
/// folder or the disk is not writable. Part of canyon::io.
void write_netcdf(const std::filesystem::path& path, const MapSource& source);

}  // namespace canyon::heatmap
