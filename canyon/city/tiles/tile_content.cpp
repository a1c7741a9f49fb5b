#include "canyon/city/tiles/tile_content.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/city/meshes/json_values.hpp"

namespace canyon::tiles {
namespace {

/// Texts of a table by column, one for each feature.
using TextColumns = std::map<std::string, std::vector<std::string>>;

constexpr std::size_t kMaxFeatureName = 120;

/// The first column with one of the names, ignoring case; empty for none.
template <std::size_t N>
std::vector<std::string> first_of(const std::array<std::string_view, N>& words, const TextColumns& columns) {
  for (const std::string_view word : words) {
    for (const auto& [name, texts] : columns)
      if (lower_case(name) == word) return texts;
  }
  return {};
}

std::string feature_text(const Json& value) {
  if (value.is_string()) return value.text().substr(0, kMaxFeatureName);
  return value.is_number() ? value.dump() : std::string();
}

std::vector<std::string> texts_of(const Json& list) {
  std::vector<std::string> texts;
  for (const Json& item : list) texts.push_back(feature_text(item));
  return texts;
}

/// The class name of each instance of a batch table with a hierarchy.
std::vector<std::string> hierarchy_kinds(const Json& hierarchy) {
  std::vector<std::string> kinds;
  const Json* classes = hierarchy.find("classes");
  const Json* ids = hierarchy.find("classIds");
  if (classes == nullptr || ids == nullptr || !classes->is_array() || !ids->is_array()) return kinds;
  for (const Json& id : *ids) {
    const bool known =
        id.is_integer() && id.get<double>() >= 0 && id.get<double>() < static_cast<double>(classes->size());
    kinds.push_back(known ? feature_text((*classes)[static_cast<std::size_t>(id.get<double>())]["name"])
                          : std::string());
  }
  return kinds;
}

FeatureNames feature_names(const TextColumns& columns) {
  static constexpr std::array<std::string_view, 9> kNames{"name",   "gml:name",  "gml_id", "gml:id", "gmlid",
                                                          "osm_id", "elementid", "id",     "uuid"};
  static constexpr std::array<std::string_view, 10> kKinds{
      "class",     "feature_type", "_feature_type", "featuretype", "feature:type",
      "classname", "objecttype",   "type",          "category",    "layer"};
  return {first_of(kNames, columns), first_of(kKinds, columns)};
}

/// The names of a b3dm or i3dm batch table (3D Tiles 1.0, "Batch Table"): its lists in JSON, and the classes
/// of 3DTILES_batch_table_hierarchy. Lists in the binary part contain only numbers and are not read.
FeatureNames batch_names(const Json& table) {
  if (!table.is_object()) return {};
  TextColumns columns;
  for (const Json::Member& member : table.members())
    if (member.value.is_array()) columns[member.key] = texts_of(member.value);
  FeatureNames names = feature_names(columns);
  const Json& in_extensions = table["extensions"]["3DTILES_batch_table_hierarchy"];
  const Json& hierarchy = in_extensions.is_object() ? in_extensions : table["HIERARCHY"];
  if (names.kind.empty() && hierarchy.is_object()) names.kind = hierarchy_kinds(hierarchy);
  return names;
}

constexpr int kDeepestComposite = 8;
constexpr std::uint64_t kMaxInstances = 200'000;

Eigen::Matrix4d translation(const Eigen::Vector3d& by) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topRightCorner<3, 1>() = by;
  return matrix;
}

/// Rotation from the glTF's up axis to z up: Y up rotates about x by 90 deg, X up about y by -90 deg.
Eigen::Matrix4d z_up_from_gltf(char up) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  if (up == 'Y') matrix.topLeftCorner<3, 3>() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  if (up == 'X') matrix.topLeftCorner<3, 3>() << 0, 0, -1, 0, 1, 0, 1, 0, 0;
  return matrix;
}

Json parse_or_empty(std::string_view text) {
  const std::string_view bare = trim(text.substr(0, std::min(text.size(), text.find('\0'))));
  return bare.empty() ? Json::object() : Json::parse(bare);
}

/// The tables before a b3dm's or i3dm's glTF.
struct TileTables {
  Json feature, batch;
  std::string_view feature_binary, rest;
  std::string_view gltf_format;
};

TileTables read_tables(std::string_view tile, std::size_t header) {
  if (meshes::little<std::uint32_t>(tile, 4) != 1) {
    throw InputError(
        fmt::format("is of version {}; only version 1 exists", meshes::little<std::uint32_t>(tile, 4)));
  }
  std::uint64_t at = header;
  const auto next = [&](std::uint64_t field) {
    const auto length = meshes::little<std::uint32_t>(tile, field);
    const std::string_view out = meshes::piece(tile, at, length);
    at += length;
    return out;
  };
  TileTables tables;
  const std::string_view feature = next(12);
  tables.feature_binary = next(16);
  const std::string_view batch = next(20);
  (void)next(24);
  tables.feature = parse_or_empty(feature);
  tables.batch = parse_or_empty(batch);
  tables.rest = tile.substr(static_cast<std::size_t>(at));
  return tables;
}

/// A feature table's property, in JSON or in the binary part; empty if it is not there.
template <typename Stored>
std::vector<double> feature_values(const TileTables& tables, const char* key, std::uint64_t count) {
  std::vector<double> values;
  const Json* found = tables.feature.find(key);
  if (found == nullptr) return values;
  if (found->is_array()) {
    if (found->size() < count) throw InputError(fmt::format("{} is too short", key));
    return found->get<std::vector<double>>();
  }
  if (count > tables.feature_binary.size() / sizeof(Stored))
    throw InputError(fmt::format("{} extends beyond the feature table", key));
  const std::string_view bytes = meshes::piece(
      tables.feature_binary, meshes::count_member(*found, "byteOffset"), count * sizeof(Stored));
  values.reserve(static_cast<std::size_t>(count));
  for (std::uint64_t i = 0; i < count; ++i)
    values.push_back(static_cast<double>(meshes::little<Stored>(bytes, i * sizeof(Stored))));
  return values;
}

Eigen::Vector3d rtc_centre(const TileTables& tables) {
  const std::vector<double> centre = feature_values<float>(tables, "RTC_CENTER", 3);
  return centre.empty() ? Eigen::Vector3d::Zero().eval() : Eigen::Vector3d(centre.data());
}

/// A direction of 16-bit octahedral form (3D Tiles 1.0, "Oct-encoded Normal Vectors").
Eigen::Vector3d from_octahedron(double u, double v) {
  Eigen::Vector3d n(u / 65535 * 2 - 1, v / 65535 * 2 - 1, 0);
  n.z() = 1 - std::abs(n.x()) - std::abs(n.y());
  if (n.z() < 0) {
    const Eigen::Vector2d old = n.head<2>();
    n.x() = (1 - std::abs(old.y())) * (old.x() < 0 ? -1 : 1);
    n.y() = (1 - std::abs(old.x())) * (old.y() < 0 ? -1 : 1);
  }
  return n.normalized();
}

/// The rotations, scales and positions of an i3dm's instances (3D Tiles 1.0, "Instanced 3D Model").
class Instances {
 public:
  explicit Instances(const TileTables& tables)
      : tables_(tables), count_(meshes::count_member(tables.feature, "INSTANCES_LENGTH")) {
    if (count_ > kMaxInstances) throw InputError(fmt::format("has {} instances", count_));
    read_translations();
    read_rotations();
    scale_ = feature_values<float>(tables, "SCALE", count_);
    scales_ = feature_values<float>(tables, "SCALE_NON_UNIFORM", 3 * count_);
    const Json* local = tables.feature.find("EAST_NORTH_UP");
    east_north_up_ = local != nullptr && local->is_boolean() && local->get<bool>();
  }

  [[nodiscard]] std::vector<Eigen::Matrix4d> containments() const {
    const Eigen::Vector3d centre = rtc_centre(tables_);
    std::vector<Eigen::Matrix4d> out;
    for (std::size_t i = 0; i < count_; ++i) {
      const Eigen::Vector3d point = Eigen::Vector3d(&positions_[3 * i]) + centre;
      Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
      if (!up_.empty()) {
        const Eigen::Vector3d right = right_[i], up = up_[i];
        rotation << right, up, right.cross(up);
      } else if (east_north_up_) {
        // Rows of the rotation to ENU are east, north and up.
        rotation = geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(point)).transpose();
      }
      if (!scale_.empty()) rotation *= scale_[i];
      if (!scales_.empty()) rotation *= Eigen::Vector3d(&scales_[3 * i]).asDiagonal();
      Eigen::Matrix4d matrix = translation(point);
      matrix.topLeftCorner<3, 3>() = rotation;
      out.push_back(matrix);
    }
    return out;
  }

 private:
  void read_translations() {
    positions_ = feature_values<float>(tables_, "POSITION", 3 * count_);
    if (!positions_.empty() || count_ == 0) return;
    positions_ = feature_values<std::uint16_t>(tables_, "POSITION_QUANTIZED", 3 * count_);
    const std::vector<double> low = feature_values<float>(tables_, "QUANTIZED_VOLUME_OFFSET", 3);
    const std::vector<double> size = feature_values<float>(tables_, "QUANTIZED_VOLUME_SCALE", 3);
    if (positions_.empty() || low.empty() || size.empty()) throw InputError("the instances have no POSITION");
    for (std::size_t i = 0; i < positions_.size(); ++i)
      positions_[i] = positions_[i] / 65535 * size[i % 3] + low[i % 3];
  }

  void read_rotations() {
    const auto read = [&](const char* plain, const char* packed) {
      std::vector<Eigen::Vector3d> out;
      std::vector<double> values = feature_values<float>(tables_, plain, 3 * count_);
      for (std::size_t i = 0; i < values.size() / 3; ++i) {
        const Eigen::Vector3d v(&values[3 * i]);
        if (!(v.norm() > 1e-6)) throw InputError(fmt::format("{} has a zero vector", plain));
        out.push_back(v.normalized());
      }
      if (!out.empty()) return out;
      values = feature_values<std::uint16_t>(tables_, packed, 2 * count_);
      for (std::size_t i = 0; i < values.size() / 2; ++i)
        out.push_back(from_octahedron(values[2 * i], values[2 * i + 1]));
      return out;
    };
    up_ = read("NORMAL_UP", "NORMAL_UP_OCT32P");
    right_ = read("NORMAL_RIGHT", "NORMAL_RIGHT_OCT32P");
    if (up_.size() != right_.size()) throw InputError("NORMAL_UP and NORMAL_RIGHT do not go together");
  }

  const TileTables& tables_;
  std::uint64_t count_;
  std::vector<double> positions_, scale_, scales_;
  std::vector<Eigen::Vector3d> up_, right_;
  bool east_north_up_ = false;
};

class ContentReader {
 public:
  ContentReader(char up, const meshes::FetchBytes& fetch) : axis_(z_up_from_gltf(up)), fetch_(fetch) {}

  void read(std::string_view bytes, int levels_left) {
    const std::string_view magic = bytes.substr(0, 4);
    const std::size_t first = bytes.find_first_not_of("\xEF\xBB\xBF \t\r\n");
    if (magic == "b3dm") return read_batched(whole(bytes));
    if (magic == "i3dm") return read_instanced(whole(bytes));
    if (magic == "cmpt") return read_composite(whole(bytes), levels_left);
    if (magic == "glTF" || (first != std::string_view::npos && bytes[first] == '{'))
      return add_model(bytes, {}, Eigen::Vector3d::Zero(), {Eigen::Matrix4d::Identity()});
    if (magic == "pnts") {
      out_.left_out.emplace_back("points (pnts)");
      return;
    }
    if (magic == "vctr" || magic == "geom") {
      out_.left_out.push_back(fmt::format("vector data ({})", magic));
      return;
    }
    throw InputError(bytes.empty() ? "is empty" : "is no known content of 3D Tiles",
                     "give b3dm, i3dm, cmpt or glTF");
  }

  TileContent take() { return std::move(out_); }

 private:
  /// The tile without trailing bytes.
  static std::string_view whole(std::string_view bytes) {
    return meshes::piece(bytes, 0, meshes::little<std::uint32_t>(bytes, 8));
  }

  void read_batched(std::string_view tile) {
    // Before version 1.0 the header was shorter; the JSON's first bytes are at the offsets of the lengths.
    if (meshes::little<std::uint32_t>(tile, 20) >= 570425344 ||
        meshes::little<std::uint32_t>(tile, 24) >= 570425344) {
      throw InputError("is a b3dm older than 3D Tiles 1.0, which is not supported",
                       "convert it, e.g. with 3d-tiles-tools upgrade");
    }
    const TileTables tables = read_tables(tile, 28);
    add_model(tables.rest, batch_names(tables.batch), rtc_centre(tables), {Eigen::Matrix4d::Identity()});
  }

  void read_instanced(std::string_view tile) {
    const TileTables tables = read_tables(tile, 32);
    const std::vector<Eigen::Matrix4d> containments = Instances(tables).containments();
    if (containments.empty()) return;
    if (meshes::little<std::uint32_t>(tile, 28) == 1) {
      add_model(tables.rest, {}, Eigen::Vector3d::Zero(), containments);
      return;
    }
    const std::string uri(trim(tables.rest.substr(0, std::min(tables.rest.size(), tables.rest.find('\0')))));
    if (uri.empty()) throw InputError("the instances have no model");
    add_model(fetch_(uri), {}, Eigen::Vector3d::Zero(), containments);
  }

  void read_composite(std::string_view tile, int levels_left) {
    if (levels_left == 0) throw InputError("composite tiles are nested too deeply");
    const auto count = meshes::little<std::uint32_t>(tile, 12);
    std::uint64_t at = 16;
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto length = meshes::little<std::uint32_t>(tile, at + 8);
      if (length < 12) throw InputError("a tile of a composite is shorter than its header");
      read(meshes::piece(tile, at, length), levels_left - 1);
      at += length;
    }
  }

  void add_model(std::string_view gltf, FeatureNames batch, const Eigen::Vector3d& centre,
                 const std::vector<Eigen::Matrix4d>& containments) {
    PosedModel posed;
    posed.model = meshes::read_gltf(gltf, fetch_);
    for (const auto& [number, columns] : posed.model.tables) posed.tables[number] = feature_names(columns);
    posed.batch = std::move(batch);
    const Eigen::Vector3d move = centre + posed.model.centre.value_or(Eigen::Vector3d::Zero());
    const Eigen::Matrix4d base = translation(move) * axis_;
    posed.containments.reserve(containments.size());
    for (const Eigen::Matrix4d& containment : containments)
      posed.containments.emplace_back(containment * base);
    if (posed.model.lines_and_points > 0) out_.left_out.emplace_back("lines or points of glTF");
    out_.models.push_back(std::move(posed));
  }

  Eigen::Matrix4d axis_;
  const meshes::FetchBytes& fetch_;
  TileContent out_;
};

}  // namespace

TileContent read_content(std::string_view bytes, char up, const meshes::FetchBytes& fetch) {
  try {
    ContentReader reader(up, fetch);
    reader.read(bytes, kDeepestComposite);
    return reader.take();
  } catch (const JsonError& error) {
    throw InputError(fmt::format("has invalid JSON: {}", error.what()), "get the tile again");
  }
}

std::optional<city::Surface> surface_by_word(std::string_view text) {
  using city::Surface;
  static constexpr std::pair<std::string_view, Surface> kWords[]{
      {"building", Surface::Building}, {"buildings", Surface::Building},    {"bldg", Surface::Building},
      {"roof", Surface::Building},     {"wall", Surface::Building},         {"bridge", Surface::Building},
      {"tree", Surface::Foliage},      {"trees", Surface::Foliage},         {"vegetation", Surface::Foliage},
      {"foliage", Surface::Foliage},   {"plant", Surface::Foliage},         {"forest", Surface::Foliage},
      {"terrain", Surface::Terrain},   {"ground", Surface::Terrain},        {"dem", Surface::Terrain},
      {"dtm", Surface::Terrain},       {"relief", Surface::Terrain},        {"tinrelief", Surface::Terrain},
      {"road", Surface::Terrain},      {"street", Surface::Terrain},        {"railway", Surface::Terrain},
      {"water", Surface::Terrain},     {"waterbody", Surface::Terrain},     {"landuse", Surface::Terrain},
      {"vehicle", Surface::Vehicle},   {"transportation", Surface::Terrain}};
  for (const auto& [word, surface] : kWords)
    if (city::has_word(text, word)) return surface;
  return std::nullopt;
}

}  // namespace canyon::tiles
