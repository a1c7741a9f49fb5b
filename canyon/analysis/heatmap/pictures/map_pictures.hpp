#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "canyon/analysis/heatmap/engine/map_source.hpp"

namespace canyon::heatmap {

/// Pictures: for each time, altitude and sheet of at most six layers
/// `map[_SHEET][_aALTm][_tYYYYmmddTHHMMSSZ].png` with a panel for each layer, city outlines, colour bars with
/// units, scale, north; SHEET counts from 1 if there are several, parts that do not vary are left out.
/// Returns the names by time, altitude and sheet. Each file is written completely or not at all.
///
/// A layer has the same colours on all pictures, readable by colour-blind people: see make_colour_scale(). A
/// pixel that covers several cells shows the mean of their values if at least half of them have one, else the
/// most frequent state; a pixel of a count shows the class of the rounded mean. Quantiles are those of the
/// pixels. Times whose values do not fit into 256 MB are read twice. Memory: that, one slice, and, with p
/// pixels on a map (at most 1200 x 1920 of a single layer, 572 x 916 of three), about 13 p bytes for each
/// layer and altitude. Equal sources give equal bytes on one machine (fonts are the system's).
/// @param city whose buildings are outlined; a pixel's building may be lower than the map's altitude. Throws
/// InputError if the folder or the disk is not writable. Part of canyon::io.
std::vector<std::string> write_map_pictures(const std::filesystem::path& folder, const MapSource& source,
                                            const city::City& city);

}  // namespace canyon::heatmap
