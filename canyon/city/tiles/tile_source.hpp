#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "canyon/city/tiles/tile_options.hpp"

namespace canyon::tiles {

/// Where the files of a tileset are: a folder, or a server by way of a folder of downloads. Addresses are
/// whole paths, or URLs with their keys. Nothing outside the tileset's folder or server is given, unless
/// TileOptions::elsewhere. Messages name addresses without their queries.
class TileSource {
 public:
  /// Throws InputError for an environment variable in the URL that is not set. `options` must outlive this.
  explicit TileSource(const TileOptions& options);
  ~TileSource();
  TileSource(const TileSource&) = delete;
  TileSource& operator=(const TileSource&) = delete;

  /// Address of the tileset itself.
  [[nodiscard]] const std::string& root() const { return root_; }
  /// The address that `uri` means in the file `base`. Throws InputError where it is outside the folder or the
  /// server, of another scheme, or not a URI. A URL gets those parameters of its base's query that it does
  /// not have, where both are of one server: so keys of the user reach every tile.
  [[nodiscard]] std::string resolve(const std::string& base, const std::string& uri) const;
  /// Downloads files, several at a time, that are not there yet. read() tells which failed.
  void prefetch(const std::vector<std::string>& addresses);
  /// A file's bytes, unpacked where it is packed by gzip. Throws InputError.
  [[nodiscard]] std::string read(const std::string& address);

  [[nodiscard]] std::size_t downloaded_files() const { return downloaded_files_; }
  [[nodiscard]] std::size_t downloaded_bytes() const { return downloaded_bytes_; }

 private:
  [[nodiscard]] std::string resolve_path(const std::string& base, const std::string& uri) const;
  [[nodiscard]] std::string resolve_web(const std::string& base, const std::string& uri) const;
  [[nodiscard]] std::filesystem::path cached(const std::string& address) const;
  void download(const std::vector<std::string>& addresses);

  const TileOptions& options_;
  std::string root_;
  std::filesystem::path folder_;                ///< of downloads
  std::map<std::string, std::string> fetched_;  ///< of this run: address, and what went wrong
  std::vector<std::filesystem::path> not_to_keep_;
  std::size_t downloaded_files_ = 0, downloaded_bytes_ = 0;
};

}  // namespace canyon::tiles
