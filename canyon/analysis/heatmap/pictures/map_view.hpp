#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/city/city.hpp"

namespace canyon::heatmap {

/// Maximum number of cells shown: pages, and textures of graphics processors, have limits.
inline constexpr std::size_t kMaxMapCells = std::size_t{1} << 22;
/// Maximum of a row or a column: browsers support textures at least this wide.
inline constexpr std::size_t kMaxMapColumns = 8192;

/// Adds a heat map to the view in `folder`, which has a header: cells of each altitude and values of each
/// altitude and time as chunks, and their description as the header's "map" (docs/view-format.md). Replaces
/// an existing map of the view. Colour scales are those of Canyon's own pictures.
/// @param name of the map, for people
/// @param city ground of altitudes above the terrain, as in the map: z = 0 if it has no terrain. Throws
/// InputError if the map is not at the city's position, has more than kMaxMapCells or kMaxMapColumns, has a
/// damaged tile, or the folder has no view or is not writable.
void add_map(const MapReader& map, const std::string& name, const city::City& city,
             const std::filesystem::path& folder);

/// An empty city at the map's position: shown under a map if no city is given.
[[nodiscard]] city::City field_of(const MapReader& map);

}  // namespace canyon::heatmap
