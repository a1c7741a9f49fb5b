// Declared in canyon/buildings/sources/model_readers.hpp.
#include "canyon/buildings/sources/model_readers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "canyon/base/archives.hpp"
#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/buildings/sources/gdal.hpp"
#include "canyon/buildings/sources/model_kind.hpp"

namespace canyon::buildings {
namespace {

/// A file, perhaps one in an archive.
struct Tile {
  std::filesystem::path path;  ///< for messages: "tiles.zip/a/b.gml"
  std::string inside;          ///< GDAL's name of a file in an archive; empty for one on the disk
};

ByteReader open_tile(const Tile& tile) {
  if (tile.inside.empty()) {
    return file_bytes(tile.path);
  }
  ByteReader bytes =
      gdal::bytes_of(has_ending(tile.inside, {".gz"}) ? "/vsigzip/" + tile.inside : tile.inside);
  if (!bytes)
    throw InputError(tile.path, 0, "cannot be unpacked", "is the archive cut short? fetch it again");
  return bytes;
}

ModelKind kind_of(const Tile& tile) {
  if (tile.inside.empty()) return model_kind(tile.path);
  return model_kind_of_text(first_bytes(open_tile(tile), std::size_t{1} << 16));
}

/// The files in an archive, in the order of their names.
std::vector<Tile> tiles_of_archive(const std::filesystem::path& archive) {
  const gdal::Quiet quiet;
  const std::string root = "/vsizip/{" + std::filesystem::absolute(archive).string() + "}";
  char** list = VSIReadDirRecursive(root.c_str());
  std::vector<std::string> names;
  for (int i = 0; list != nullptr && list[i] != nullptr; ++i) names.emplace_back(list[i]);
  CSLDestroy(list);
  if (names.empty()) throw InputError(archive, 0, "is an archive that cannot be read", "fetch it again");
  std::sort(names.begin(), names.end());
  std::error_code ignored;
  const std::uint64_t packed = std::filesystem::file_size(archive, ignored);
  std::uint64_t unpacked = 0;
  std::vector<Tile> tiles;
  for (const std::string& name : names) {
    std::string inside = root;
    inside.append("/").append(name);
    VSIStatBufL status;
    if (name.empty() || name.back() == '/' || VSIStatL(inside.c_str(), &status) != 0 ||
        VSI_ISDIR(status.st_mode))
      continue;
    unpacked += static_cast<std::uint64_t>(status.st_size);
    tiles.push_back({archive / name, inside});
  }
  if (unpacked > kHarmlessSize && unpacked / kMostGrowth > packed) {
    throw InputError(archive, 0, fmt::format("unpacks to more than {} times its size", kMostGrowth),
                     "is it the right file?");
  }
  return tiles;
}

std::vector<Tile> tiles_of_folder(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(
           folder, std::filesystem::directory_options::skip_permission_denied, error)) {
    if (entry.is_regular_file(error)) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<Tile> tiles;
  for (const std::filesystem::path& file : files) {
    const bool archive = has_ending(file, {".zip"}) && model_kind(file) == ModelKind::Archive;
    if (!archive) {
      tiles.push_back({file, {}});
      continue;
    }
    for (Tile& tile : tiles_of_archive(file)) tiles.push_back(std::move(tile));
  }
  return tiles;
}

class CityFiles {
 public:
  explicit CityFiles(const CityReadOptions& options) : model_(options) {}

  void read(const std::filesystem::path& path) {
    const ModelKind kind = model_kind(path);
    const bool many = kind == ModelKind::Archive || kind == ModelKind::Folder;
    const std::vector<Tile> tiles = kind == ModelKind::Archive  ? tiles_of_archive(path)
                                    : kind == ModelKind::Folder ? tiles_of_folder(path)
                                                                : std::vector<Tile>{{path, {}}};
    std::size_t good = 0;
    std::optional<InputError> first;
    for (const Tile& tile : tiles) {
      try {
        if (read_tile(tile, many)) ++good;
      } catch (const InputError& e) {
        if (!many) throw;
        model_.drop_file();
        if (!first) first = e;
        model_.say(ReadReport::Level::Loss, fmt::format("tile left out: {}", e.what()));
      }
    }
    if (good == 0 && first) throw InputError(*first);
  }

  MapData finish(const std::filesystem::path& name) {
    if (skipped_ > 0)
      model_.say(ReadReport::Level::Remark,
                 fmt::format("tiles       {} outside the box, not read", skipped_));
    if (foreign_ > 0)
      model_.say(ReadReport::Level::Remark, fmt::format("tiles       {} other files passed over", foreign_));
    return model_.finish(name);
  }

 private:
  /// False for files that are not city models.
  bool read_tile(const Tile& tile, bool many) {
    const ModelKind kind = kind_of(tile);
    if (kind != ModelKind::CityGml && kind != ModelKind::CityJson && many) {
      ++foreign_;
      return false;
    }
    model_.begin_file(tile.path);
    if (kind == ModelKind::CityJson) {
      TextFile file =
          tile.inside.empty() ? TextFile(tile.path) : TextFile::from_string(text_of(tile), tile.path);
      read_cityjson(file, model_);
    } else if (!read_citygml(
                   tile.path, [&tile] { return open_tile(tile); }, model_)) {
      ++skipped_;
    }
    return true;
  }

  static std::string text_of(const Tile& tile) {
    std::string text = first_bytes(open_tile(tile), kLargestUnpacked + 1);
    if (text.size() > kLargestUnpacked) throw InputError(tile.path, 0, "unpacks to more than 1 GiB");
    return text;
  }

  CityModel model_;
  std::size_t skipped_ = 0, foreign_ = 0;
};

}  // namespace

MapData read_city_files(const std::vector<std::filesystem::path>& paths, const CityReadOptions& options) {
  CityFiles files(options);
  std::string names;
  for (const std::filesystem::path& path : paths) {
    files.read(path);
    const std::filesystem::path name = path.has_filename() ? path.filename() : path.parent_path().filename();
    names += (names.empty() ? "" : ", ") + name.string();
  }
  return files.finish(names);
}

}  // namespace canyon::buildings
