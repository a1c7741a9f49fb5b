#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "canyon/city/tiles/tile_options.hpp"

namespace canyon::tiles {

/// Access to the files of a tileset: in a folder, or on a server with a folder of downloads. Addresses are
/// absolute paths, or URLs with their keys. Access is limited to the tileset's folder or server, unless
/// TileOptions::elsewhere is set. Messages name addresses without their queries.
class TileSource {
 public:
  /// Throws InputError for an unset environment variable in the URL. `options` must outlive this object.
  explicit TileSource(const TileOptions& options);
  ~TileSource();
  TileSource(const TileSource&) = delete;
  TileSource& operator=(const TileSource&) = delete;

  /// Address of the tileset itself.
  [[nodiscard]] const std::string& root() const { return root_; }
  /// Resolves `uri` in the file `base`. Throws InputError if the result is outside the folder or the server,
  /// has another scheme, or `uri` is not a URI. A URL inherits missing query parameters from its base, if
  /// both are on the same server: so the user's keys reach every tile.
  [[nodiscard]] std::string resolve(const std::string& base, const std::string& uri) const;
  /// Downloads missing files, several in parallel. read() reports failures.
  void prefetch(const std::vector<std::string>& addresses);
  /// A file's bytes, unpacked if it is gzip-compressed. Throws InputError.
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
  std::map<std::string, std::string> fetched_;  ///< of this run: address and error
  std::vector<std::filesystem::path> not_to_keep_;
  std::size_t downloaded_files_ = 0, downloaded_bytes_ = 0;
};

}  // namespace canyon::tiles
