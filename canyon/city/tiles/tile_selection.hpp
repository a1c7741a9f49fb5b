#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "canyon/city/tiles/tile_source.hpp"
#include "canyon/city/tiles/tile_volume.hpp"

namespace canyon::tiles {

/// A file with geometry to read.
struct SelectedTile {
  std::string address;
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();  ///< to the root's frame
  char up = 'Y';                                            ///< of its glTF
  double error_m = 0;                                       ///< its geometric error
};

struct TileSelection {
  std::vector<SelectedTile> tiles;
  std::string version;            ///< of the root: "1.0"
  std::size_t tilesets = 0;       ///< read, including the root
  std::size_t subtrees = 0;       ///< read
  std::size_t beyond = 0;         ///< tiles that do not touch the area, without their descendants
  double coarsest_m = 0;          ///< the largest geometric error of a selected tile
  std::vector<std::string> gaps;  ///< one line for each file that could not be read, with its address
};

/// The root's volume and kind, read from the root alone.
struct TilesetRoot {
  std::optional<Eigen::Vector3d> centre;  ///< of the root's volume
  bool on_earth = false;                  ///< the centre is near the Earth's surface: the frame is ECEF
};
[[nodiscard]] TilesetRoot read_root(TileSource& source);

/// Chooses the coarsest tiles in an area whose geometric error is at most `error_m`, and their ancestors if
/// these are refined by ADD. Reads external tilesets and subtrees on demand, those of one level together, so
/// that downloads run in parallel. A tile without content of its own is never fine enough: with a wrong
/// geometric error it would leave a hole. A reference that cannot be read is a gap. Throws InputError if the
/// root cannot be read, and for more than `options.max_tiles` tiles.
[[nodiscard]] TileSelection select_tiles(TileSource& source, const TileArea& area,
                                         const TileOptions& options);

/// A line with an address, without its query, and its error.
[[nodiscard]] std::string gap_line(const std::string& address, const std::exception& error);

}  // namespace canyon::tiles
