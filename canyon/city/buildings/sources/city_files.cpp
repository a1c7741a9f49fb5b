#include "canyon/city/buildings/sources/city_files.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/city/buildings/sources/cityjson_reader.hpp"
#include "canyon/city/buildings/sources/gdal.hpp"
#include "canyon/city/buildings/sources/gml_document.hpp"
#include "canyon/city/buildings/sources/gml_objects.hpp"
#include "canyon/city/buildings/sources/model_kind.hpp"

namespace canyon::buildings {
namespace {

/// Opens a file at its beginning; called again if objects refer to later ones.
using OpenBytes = std::function<ByteReader()>;

constexpr int kMaxPasses = 4;  // for references to geometries that refer to others, and so on

/// Whether a file's envelope touches the box; true if its position is not known.
bool reaches_box(const GmlEnvelope& envelope, CityModel& model) {
  if (!model.options().box || envelope.system == nullptr) return true;
  const std::size_t system = model.system(*envelope.system, false, envelope.line);
  std::vector<Eigen::Vector3d> corners;
  for (const double x : {envelope.lower.x(), envelope.upper.x()})
    for (const double y : {envelope.lower.y(), envelope.upper.y()})
      corners.push_back(model.east_first(system, {x, y, envelope.lower.z()}));
  model.to_wgs84(system, corners);
  constexpr double kMargin_deg = 1e-3;
  Eigen::AlignedBox2d bounds;
  for (const Eigen::Vector3d& corner : corners) {
    if (!corner.allFinite()) return true;
    bounds.extend(LonLat(corner.head<2>() + LonLat::Constant(kMargin_deg)));
    bounds.extend(LonLat(corner.head<2>() - LonLat::Constant(kMargin_deg)));
  }
  const LonLatBox whole = model.options().box->unwrapped();
  return Eigen::AlignedBox2d(LonLat(whole.west, whole.south), LonLat(whole.east, whole.north))
      .intersects(bounds);
}

/// The handedness() of most of a file's first objects.
int handedness_of(const std::filesystem::path& file, const OpenBytes& open) {
  constexpr int kObjects = 100;
  int requested = 0, reported = 0, sum = 0;
  GmlSink sink;
  sink.envelope = [](const GmlEnvelope&) { return true; };
  sink.member = [&](const GmlElement& object) {
    const int hand = handedness(object);
    reported += std::abs(hand);
    sum += hand;
    return ++requested < kObjects;
  };
  read_gml(file, open(), sink);
  return 2 * std::abs(sum) > reported ? (sum > 0 ? 1 : -1) : 0;
}

/// Copies the elements with those ids into the library.
void find_ids(const GmlElement& element, const std::set<std::string>& wanted, GmlLibrary& library) {
  if (!element.id.empty() && wanted.count(element.id) > 0) library.emplace(element.id, element);
  for (const GmlElement& child : element.children) find_ids(child, wanted, library);
}

/// Elements of a file that its objects reference and that are outside of them.
class References {
 public:
  References(const std::filesystem::path& file, const OpenBytes& open) : file_(file), open_(open) {}

  /// Reads the file until each of these is found, with their own references.
  [[nodiscard]] GmlLibrary find(std::set<std::string> wanted) const {
    GmlLibrary library;
    for (int pass = 0; pass < kMaxPasses && !wanted.empty(); ++pass) {
      const std::size_t before = library.size();
      GmlSink sink;
      sink.envelope = [](const GmlEnvelope&) { return true; };
      sink.member = [&](const GmlElement& object) {
        find_ids(object, wanted, library);
        return true;
      };
      read_gml(file_, open_(), sink);
      if (library.size() == before) break;
      wanted.clear();
      for (const auto& [id, element] : library) {
        for (const std::string& missing : references_of(element))
          if (library.count(missing) == 0) wanted.insert(missing);
      }
    }
    return library;
  }

 private:
  static std::set<std::string> references_of(const GmlElement& element) {
    std::set<std::string> ids;
    if (!element.href.empty()) ids.insert(element.href.substr(element.href.find('#') + 1));
    for (const GmlElement& child : element.children) ids.merge(references_of(child));
    return ids;
  }

  const std::filesystem::path& file_;
  const OpenBytes& open_;
};

/// Adds the objects of a CityGML file to a model. A file whose envelope is outside the box is not read.
/// @return whether the file was read
bool read_citygml(const std::filesystem::path& file, const OpenBytes& open, CityModel& model) {
  std::set<std::string> wanted;
  std::set<std::size_t> waiting;  // numbers of the objects with references to others
  bool reached = true;
  std::size_t number = 0;
  const GmlLibrary none;
  model.query_handedness([&] { return handedness_of(file, open); });
  GmlSink sink;
  sink.envelope = [&](const GmlEnvelope& envelope) { return reached = reaches_box(envelope, model); };
  sink.member = [&](const GmlElement& object) {
    const std::size_t own = number++;
    if (!is_gml_object(object.name)) {
      model.leave_out("city objects of type " + object.name, 1, ReadReport::Level::Remark);
      return true;
    }
    std::set<std::string> missing = missing_references(object, none);
    if (missing.empty()) {
      read_gml_object(object, none, model);
    } else {
      wanted.merge(missing);
      waiting.insert(own);
    }
    return true;
  };
  read_gml(file, open(), sink);
  if (!reached || waiting.empty()) return reached;
  const GmlLibrary library = References(file, open).find(wanted);
  number = 0;
  sink.envelope = [](const GmlEnvelope&) { return true; };
  sink.member = [&](const GmlElement& object) {
    if (waiting.count(number++) > 0) read_gml_object(object, library, model);
    return true;
  };
  read_gml(file, open(), sink);
  return true;
}

/// A file, on the disk or in an archive.
struct Tile {
  std::filesystem::path path;  ///< for messages: "tiles.zip/a/b.gml"
  std::string inside;          ///< GDAL's name of a file in an archive; empty for one on the disk
};

ByteReader open_tile(const Tile& tile) {
  if (tile.inside.empty()) return file_bytes(tile.path);
  ByteReader bytes =
      gdal::bytes_of(has_ending(tile.inside, {".gz"}) ? "/vsigzip/" + tile.inside : tile.inside);
  if (!bytes)
    throw InputError(tile.path, 0, "cannot be unpacked", "is the archive cut short? fetch it again");
  return bytes;
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
  if (unpacked > kHarmlessSize && unpacked / kMaxGrowth > packed) {
    throw InputError(archive, 0, fmt::format("unpacks to more than {} times its size", kMaxGrowth),
                     "is it the right file?");
  }
  return tiles;
}

std::vector<Tile> tiles_of_folder(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(
           folder, std::filesystem::directory_options::skip_permission_denied, error))
    if (entry.is_regular_file(error)) files.push_back(entry.path());
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
        model_.add_line(ReadReport::Level::Loss, fmt::format("tile left out: {}", e.what()));
      }
    }
    if (good == 0 && first) throw InputError(*first);
  }

  MapData finish(const std::filesystem::path& name) {
    if (skipped_ > 0)
      model_.add_line(ReadReport::Level::Remark,
                      fmt::format("tiles       {} outside the box, not read", skipped_));
    if (foreign_ > 0)
      model_.add_line(ReadReport::Level::Remark, fmt::format("tiles       {} other files ignored", foreign_));
    return model_.finish(name);
  }

 private:
  /// Returns false for files that are not city models.
  bool read_tile(const Tile& tile, bool many) {
    const ModelKind kind = tile.inside.empty()
                               ? model_kind(tile.path)
                               : model_kind_of_text(first_bytes(open_tile(tile), std::size_t{1} << 16));
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
    std::string text = first_bytes(open_tile(tile), kMaxUnpacked + 1);
    if (text.size() > kMaxUnpacked) throw InputError(tile.path, 0, "unpacks to more than 1 GiB");
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
