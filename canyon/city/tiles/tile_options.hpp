#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "canyon/base/options/fwd.hpp"
#include "canyon/base/text.hpp"

namespace canyon::tiles {

// Options for 3D Tiles. In canyon::canyon, because scenarios contain them; their code is in canyon::io.
/// `city: {tiles: ...}`: the part of a tileset to read, and its resolution. One of file and url is set.
struct TileOptions {
  std::optional<std::filesystem::path> file;  ///< tileset.json, or an archive (.3tz)
  /// http or https; $NAME or ${NAME} in its query is an environment variable.
  std::string url;
  double error_m = 1;  ///< geometric error up to which a tile is fine enough; [0, 10,000]
  std::optional<std::array<double, 4>> bbox_deg;  ///< west, south, east, north
  /// Around the positions of a scenario's trajectory and receivers, if there is no box; [10, 50,000].
  double margin_m = 500;
  int max_tiles = 2000;         ///< contents that are read; [1, 1,000,000]
  bool allow_external = false;  ///< tiles may be outside the tileset's folder or server
  std::string cache;            ///< folder of downloads; empty: $XDG_CACHE_HOME/canyon or ~/.cache/canyon
  int timeout_s = 30;           ///< timeout of a server that stops sending; [1, 3600]
  /// Throws InputError with the field and its bound.
  void validate() const;
};
void visit(options::Visitor& v, TileOptions& o);

/// Whether a text is a web address: begins with http:// or https://.
[[nodiscard]] bool is_web_address(const std::string& text);

/// An address without its query and password, which may contain keys, as a path: for messages and files.
[[nodiscard]] std::string public_address(const std::string& address);

/// Whether the query of an address has a value that is not from an environment variable.
[[nodiscard]] bool holds_key(const std::string& address);

/// Whether a path names a tileset: a web address, an archive (.3tz), the name tileset.json, or a .json file
/// that begins as a tileset.
[[nodiscard]] bool is_tileset(const std::filesystem::path& path);

// Addresses of files in archives of a tileset (.3tz): `/vsizip/{archive}/file`, as GDAL opens them.
inline constexpr std::string_view kInArchive = "/vsizip/{";

/// Whether a path names an archive of a tileset: ends with .3tz.
[[nodiscard]] inline bool is_archive(const std::filesystem::path& path) {
  return lower_case(path.extension().string()) == ".3tz";
}

/// Whether an address names a file in an archive.
[[nodiscard]] inline bool is_in_archive(std::string_view address) {
  return address.substr(0, kInArchive.size()) == kInArchive;
}

/// The address of a file in an archive. @param archive a whole path
[[nodiscard]] inline std::string in_archive(const std::string& archive, std::string_view file) {
  return std::string(kInArchive).append(archive).append("}/").append(file);
}

}  // namespace canyon::tiles
