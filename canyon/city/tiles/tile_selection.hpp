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

/// A file with geometry that is to be read.
struct SelectedTile {
  std::string address;
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();  ///< to the root's frame
  char up = 'Y';                                            ///< of its glTF
  double error_m = 0;                                       ///< its geometric error
};

struct TileSelection {
  std::vector<SelectedTile> tiles;
  std::string version;            ///< of the root: "1.0"
  std::size_t tilesets = 0;       ///< read, the root among them
  std::size_t subtrees = 0;       ///< read
  std::size_t beyond = 0;         ///< tiles that do not touch the area; those below them are not counted
  double coarsest_m = 0;          ///< the largest geometric error of a selected tile
  std::vector<std::string> gaps;  ///< what could not be read, one line each, with its address
};

/// The root's volume and kind, without reading more than the root.
struct TilesetRoot {
  std::optional<Eigen::Vector3d> centre;  ///< of the root's volume
  bool on_earth = false;                  ///< that is near the Earth's surface: the frame is ECEF
};
[[nodiscard]] TilesetRoot read_root(TileSource& source);

/// Chooses the coarsest tiles in an area whose geometric error is at most `error_m`, and their ancestors
/// where these are refined by ADD. Reads outer tilesets and subtrees as it comes to them, those of a level at
/// a time, so that downloads run beside one another. A tile without content of its own is never fine enough:
/// stopping there would leave a hole where its error is stated wrongly. A reference that cannot be read is a
/// gap. Throws InputError where the root cannot be read, and for more than `options.most_tiles` tiles.
[[nodiscard]] TileSelection select_tiles(TileSource& source, const TileArea& area,
                                         const TileOptions& options);

/// A line that names an address, without its query, and what is wrong with it.
[[nodiscard]] std::string gap_line(const std::string& address, const std::exception& error);

}  // namespace canyon::tiles
