#pragma once

#include <cstddef>
#include <functional>
#include <optional>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/tiles/tile_options.hpp"

namespace canyon::tiles {

struct TilesCity {
  city::City city;
  bool georeferenced = true;        ///< the tileset says its place on the Earth
  std::size_t tiles = 0, gaps = 0;  ///< contents that were read, and that could not be
};

/// Reads 3D Tiles 1.0 and 1.1: the coarsest tiles in the area of `options` whose geometric error is at most
/// error_m, or all of the tileset where there is no area. Positions are exact to the file's own rounding: all
/// is done in double precision.
///
/// A tileset on the Earth stands about `origin`; where that is empty, about the middle of what was read, at
/// the height that 5 % of its vertices lie below. Heights of 3D Tiles are ellipsoidal. A tileset with a frame
/// of its own is taken as east, north, up about `origin`; it is georeferenced by that alone.
///
/// A tile that is missing or broken is a gap: it is named, the rest is read. Throws InputError where the
/// tileset itself cannot be read, where nothing is left, and where more than most_tiles are needed.
/// `progress` is called with the tiles that are done and in all.
[[nodiscard]] TilesCity read_tiles(const TileOptions& options, const std::optional<geodesy::Geodetic>& origin,
                                   const std::function<void(std::size_t, std::size_t)>& progress = {});

}  // namespace canyon::tiles
