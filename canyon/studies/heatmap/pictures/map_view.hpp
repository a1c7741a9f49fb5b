#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "canyon/city/city.hpp"
#include "canyon/studies/heatmap/engine/map_source.hpp"

namespace canyon::view {

/// More cells than this are not shown: pages, and pictures of graphics processors, have bounds.
inline constexpr std::size_t kMostMapCells = std::size_t{1} << 22;
/// Nor than this in a row or a column: pictures of browsers are so wide at least.
inline constexpr std::size_t kMostMapColumns = 8192;

/// Adds a heat map to the view in `folder`, which has a header: cells of each altitude and values of each
/// altitude and time as chunks, and what they are as the header's "map" (docs/view-format.md). A map that the
/// view has already is replaced. Colour scales are those of Canyon's own pictures.
/// @param name of the map, for people
/// @param city what altitudes above the terrain stand on, as in the map: on z = 0 where it has no terrain
/// Throws InputError where the map is of another place than the city, has more than kMostMapCells
/// or kMostMapColumns, a tile of
/// it is damaged, or the folder has no view or does not take the files.
void add_map(const heatmap::MapAnswers& map, const std::string& name, const city::City& city,
             const std::filesystem::path& folder);

/// A city without anything in it about the map's place: what a map is shown over where no city is given.
[[nodiscard]] city::City field_of(const heatmap::MapAnswers& map);

}  // namespace canyon::view
