#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "canyon/studies/heatmap/engine/map_source.hpp"

namespace canyon::heatmap {

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

}  // namespace canyon::heatmap
