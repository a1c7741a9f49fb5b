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
  bool georeferenced = true;        ///< the tileset has a position on the Earth
  std::size_t tiles = 0, gaps = 0;  ///< contents that were read, and that could not be read
};

/// Reads 3D Tiles 1.0 and 1.1: the coarsest tiles in the area of `options` whose geometric error is at most
/// error_m, or all of the tileset without an area. Positions are exact to the file's own rounding: all
/// computations use double precision.
///
/// A georeferenced tileset is read about `origin`; if that is empty, about the middle of the read tiles, at
/// the 5 % quantile of their vertices' heights. Heights of 3D Tiles are ellipsoidal. A tileset with a frame
/// of its own is read as east, north, up about `origin`, which alone georeferences it.
///
/// A missing or broken tile is a gap: it is named, the rest is read. Throws InputError if the tileset itself
/// cannot be read, if no tile is left, and if more than max_tiles are needed. `progress` is called with the
/// numbers of finished and of all tiles.
[[nodiscard]] TilesCity read_tiles(const TileOptions& options, const std::optional<geodesy::Geodetic>& origin,
                                   const std::function<void(std::size_t, std::size_t)>& progress = {});

}  // namespace canyon::tiles
