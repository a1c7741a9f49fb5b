#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "canyon/city/fwd.hpp"
#include "canyon/heatmap/engine/map_source.hpp"
#include "canyon/options/fwd.hpp"

namespace canyon::heatmap {

struct MapPictureOptions {
  double pixels_per_unit = 2;            ///< of the stills, whose text is 11 units high; [1, 8]
  double animation_pixels_per_unit = 1;  ///< likewise; [0.5, 8]
  double frame_s = 0.5;                  ///< how long an animation shows each time; [0.001, 65]
  /// Values to draw stay in memory up to this [bytes]; the others are read from the source a second
  /// time.
  std::size_t kept_bytes = std::size_t{256} << 20;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
/// Visits its fields.
void visit(options::Visitor& v, MapPictureOptions& o);

/// write_map_pictures() of map_source.hpp, with options. For each time, altitude and sheet of at most six
/// layers `map[_SHEET][_aALTm][_tYYYYmmddTHHMMSSZ].png`, and with more than one time, for each altitude and
/// sheet, `map[_SHEET][_aALTm]_animation.png` (see AnimatedPng); SHEET counts from 1 where there are several,
/// parts that do not vary are left out. Returns the names by time, altitude and sheet, animations last. Each
/// file appears whole or not at all, animations at the end.
///
/// A layer has the same colours on all pictures: see make_colour_scale(). A pixel that covers several cells
/// has the mean of their values where at least half of them have one, else it shows what most of them are; a
/// pixel of a count shows the class that the mean, rounded, is in. Quantiles are those of the pixels. Times
/// that do not fit into `kept_bytes` are asked for twice. Memory: that, one slice, and, with p pixels on a
/// map (at most 1200 x 1920 of a single layer, 572 x 916 of three, at two to the unit), about 13 p bytes for
/// each layer and altitude and 24 p for each altitude. Equal sources give equal bytes on one machine (fonts
/// are the system's).
/// @param city whose buildings are outlined; a pixel's building need not reach the map's altitude
/// Throws InputError where the folder or the disk does not take it, and for options that do not validate().
/// Part of canyon::io.
std::vector<std::string> write_map_pictures(const std::filesystem::path& folder, const MapSource& source,
                                            const city::City& city, const MapPictureOptions& options);

}  // namespace canyon::heatmap
