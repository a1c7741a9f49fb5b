#include "canyon/city/meshes/gltf_model.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/city/meshes/gltf_buffers.hpp"
#include "canyon/city/meshes/json_values.hpp"
#include "canyon/city/meshes/mesh_scene.hpp"

namespace canyon::meshes {
namespace {

constexpr std::uint32_t kGltfMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
constexpr int kDeepestNode = 100;
constexpr std::size_t kMaxInstances = 1'000'000, kMaxVertices = 3 * kMaxTriangles;
constexpr std::size_t kMaxCopyright = 300;
// glTF 2.0, 3.7.2.1.
constexpr std::uint64_t kTriangleMode = 4, kStripMode = 5, kFanMode = 6;

/// Whether geometry does not depend on the extension, or the extension is supported.
bool can_read(const std::string& extension) {
  static const std::set<std::string> kRead{"KHR_mesh_quantization",
                                           "KHR_draco_mesh_compression",
                                           "EXT_meshopt_compression",
                                           "EXT_mesh_gpu_instancing",
                                           "EXT_mesh_features",
                                           "EXT_structural_metadata",
                                           "EXT_instance_features",
                                           "EXT_feature_metadata",
                                           "CESIUM_RTC",
                                           "CESIUM_primitive_outline",
                                           "KHR_texture_basisu",
                                           "KHR_texture_transform",
                                           "KHR_lights_punctual",
                                           "KHR_xmp_json_ld",
                                           "EXT_texture_webp",
                                           "MSFT_texture_dds"};
  return kRead.count(extension) > 0 || extension.rfind("KHR_materials_", 0) == 0;
}

struct GltfParts {
  std::string_view json, binary;
};

GltfParts split_glb(std::string_view bytes) {
  if (bytes.size() < 4 || little<std::uint32_t>(bytes, 0) != kGltfMagic) return {bytes, {}};
  const auto version = little<std::uint32_t>(bytes, 4);
  if (version != 2) {
    throw InputError(fmt::format("is glTF {}, which is not supported", version),
                     "convert it to glTF 2.0, e.g. with gltf-pipeline or 3d-tiles-tools upgrade");
  }
  const std::string_view whole = piece(bytes, 0, little<std::uint32_t>(bytes, 8));
  GltfParts parts;
  for (std::uint64_t at = 12; at + 8 <= whole.size();) {
    const auto length = little<std::uint32_t>(whole, at), kind = little<std::uint32_t>(whole, at + 4);
    const std::string_view data = piece(whole, at + 8, length);
    if (kind == kJsonChunk && parts.json.empty()) parts.json = data;
    if (kind == kBinaryChunk && parts.binary.empty()) parts.binary = data;
    at += 8 + std::uint64_t{length};
  }
  return parts;
}

/// A transform of three numbers, a quaternion and three factors; null: none.
Eigen::Matrix4d transform_of(const double* move, const double* rotation_angle, const double* scale) {
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  if (move != nullptr) transform.translate(Eigen::Vector3d(move));
  if (rotation_angle != nullptr) {
    const Eigen::Quaterniond rotation(rotation_angle[3], rotation_angle[0], rotation_angle[1],
                                      rotation_angle[2]);
    if (!(rotation.norm() > 1e-6)) throw InputError("a node's rotation is zero");
    transform.rotate(rotation.normalized());
  }
  if (scale != nullptr) transform.scale(Eigen::Vector3d(scale));
  return transform.matrix();
}

Eigen::Matrix4d node_matrix(const Json& node) {
  if (node.contains("matrix")) {
    if (node.contains("translation") || node.contains("rotation") || node.contains("scale"))
      throw InputError("a node has both a matrix and a translation, rotation or scale");
    return matrix_member(node, "matrix");
  }
  const std::vector<double> move = numbers_member(node, "translation", 3);
  const std::vector<double> rotation = numbers_member(node, "rotation", 4);
  const std::vector<double> scale = numbers_member(node, "scale", 3);
  const auto given = [](const std::vector<double>& values) {
    return values.empty() ? nullptr : values.data();
  };
  return transform_of(given(move), given(rotation), given(scale));
}

/// Triangles of indices in glTF's order; strips alternate.
TriangleList triangles_of(const std::vector<std::uint32_t>& index, std::uint64_t mode) {
  TriangleList triangles;
  if (mode == kTriangleMode) {
    for (std::size_t i = 0; i + 2 < index.size(); i += 3)
      triangles.push_back({index[i], index[i + 1], index[i + 2]});
  } else {
    for (std::size_t i = 0; i + 2 < index.size(); ++i)
      if (mode == kFanMode)
        triangles.push_back({index[0], index[i + 1], index[i + 2]});
      else
        triangles.push_back({index[i], index[i + 1 + i % 2], index[i + 2 - i % 2]});
  }
  return triangles;
}

class GltfDecoder {
 public:
  GltfDecoder(const Json& asset, std::string_view binary, const FetchBytes& fetch)
      : asset_(asset), buffers_(asset, binary, fetch) {}

  GltfModel read() {
    check_asset();
    model_.copyright = text_member(asset_.at("asset"), "copyright").substr(0, kMaxCopyright);
    const Json& rtc = extension(asset_, "CESIUM_RTC");
    if (rtc.is_object()) {
      const std::vector<double> centre = numbers_member(rtc, "center", 3);
      if (!centre.empty()) model_.centre = Eigen::Vector3d(centre[0], centre[1], centre[2]);
    }
    const Json* scenes = asset_.find("scenes");
    const auto read_root = [this](std::uint64_t root) {
      read_node(root, Eigen::Matrix4d::Identity(), {}, {}, kDeepestNode);
    };
    model_.no_scene = scenes == nullptr || scenes->size() == 0;
    if (model_.no_scene)
      for (const std::uint64_t root : nodes_without_parent()) read_root(root);
    else if (const Json* roots = buffers_.item("scenes", count_member(asset_, "scene", 0)).find("nodes"))
      for (const Json& root : *roots) read_root(node_number(root));
    const Json* meshes = asset_.find("meshes");
    if (meshes != nullptr) model_.meshes_outside = meshes->size() - meshes_.size();
    return std::move(model_);
  }

 private:
  void check_asset() const {
    // 5.9: minVersion is the version that a reader must support.
    const Json& asset = asset_.at("asset");
    const std::string least = text_member(asset, "minVersion");
    const std::string version = least.empty() ? text_member(asset, "version") : least;
    if (least.empty() ? version.rfind("2.", 0) != 0 : least != "2.0") {
      throw InputError(fmt::format("is glTF '{}', which is not supported", version),
                       "convert it to glTF 2.0, e.g. with gltf-pipeline or 3d-tiles-tools upgrade");
    }
    const Json* required = asset_.find("extensionsRequired");
    if (required == nullptr) return;
    for (const Json& name : *required)
      if (!can_read(name.text()))
        throw InputError(fmt::format("requires the glTF extension '{}' (not supported)", name.text()));
  }

  static std::string name_of(const Json& object) { return text_member(object, "name").substr(0, kMaxName); }

  static std::uint64_t node_number(const Json& value) {
    if (!value.is_integer() || value.get<double>() < 0) throw InputError("a list of nodes has no numbers");
    return static_cast<std::uint64_t>(value.get<double>());
  }

  /// The roots of a file without scenes (glTF 2.0, 3.5.1: a library of entities).
  [[nodiscard]] std::set<std::uint64_t> nodes_without_parent() const {
    std::set<std::uint64_t> roots;
    const Json* nodes = asset_.find("nodes");
    if (nodes == nullptr) return roots;
    for (std::uint64_t i = 0; i < nodes->size(); ++i) roots.insert(roots.end(), i);
    for (const Json& node : *nodes) {
      const Json* children = node.find("children");
      if (children == nullptr) continue;
      for (const Json& child : *children) roots.erase(node_number(child));
    }
    return roots;
  }

  void read_node(std::uint64_t index, const Eigen::Matrix4d& above, const std::string& name_above,
                 const std::string& names_above, int levels_left) {
    if (levels_left == 0 || !seen_.insert(index).second)
      throw InputError("nodes are nested too deeply or belong to several nodes");
    const Json& node = buffers_.item("nodes", index);
    const Eigen::Matrix4d matrix = above * node_matrix(node);
    const std::string own = name_of(node);
    const std::string& name = own.empty() ? name_above : own;
    model_.hidden += extension(node, "KHR_node_visibility")["visible"] == false ? 1U : 0U;
    if (node.contains("mesh")) {
      const Json& mesh = buffers_.item("meshes", count_member(node, "mesh"));
      meshes_.insert(count_member(node, "mesh"));
      const std::string mesh_name = name_of(mesh);
      const std::vector<Eigen::Matrix4d> points = instances(node, matrix);
      GltfPrimitive out;
      out.node_index = index;
      out.node = name.empty() ? mesh_name : name;
      out.above = names_above;
      for (const Json& primitive : mesh.at("primitives")) read_primitive(primitive, points, out);
    }
    const Json* children = node.find("children");
    if (children == nullptr) return;
    for (const Json& child : *children)
      read_node(node_number(child), matrix, name, (names_above + '/' + own).substr(0, kMaxName),
                levels_left - 1);
  }

  /// The transforms of a node's mesh: one, or several from EXT_mesh_gpu_instancing.
  std::vector<Eigen::Matrix4d> instances(const Json& node, const Eigen::Matrix4d& matrix) {
    const Json& instancing = extension(node, "EXT_mesh_gpu_instancing");
    if (!instancing.is_object()) return {matrix};
    const Json& attributes = instancing.at("attributes");
    const auto read = [&](const char* name, std::size_t width) {
      AccessorValues values;
      if (attributes.contains(name)) values = buffers_.accessor(count_member(attributes, name));
      if (!values.values.empty() && values.width != width)
        throw InputError(fmt::format("the instances' {} is of a wrong type", name));
      return values;
    };
    const AccessorValues move = read("TRANSLATION", 3), rotation = read("ROTATION", 4),
                         scale = read("SCALE", 3);
    const std::size_t count = std::max({move.count, rotation.count, scale.count});
    for (const AccessorValues* each : {&move, &rotation, &scale})
      if (each->count != 0 && each->count != count) throw InputError("the instances' lists differ in length");
    if ((instances_ += count) > kMaxInstances)
      throw InputError(fmt::format("has more than {} instances", kMaxInstances));
    std::vector<Eigen::Matrix4d> points;
    for (std::size_t i = 0; i < count; ++i) {
      const auto of = [i](const AccessorValues& all) {
        return all.count > 0 ? &all.values[all.width * i] : nullptr;
      };
      points.emplace_back(matrix * transform_of(of(move), of(rotation), of(scale)));
    }
    return points;
  }

  void read_primitive(const Json& primitive, const std::vector<Eigen::Matrix4d>& points, GltfPrimitive out) {
    const std::uint64_t mode = count_member(primitive, "mode", kTriangleMode);
    if (mode != kTriangleMode && mode != kStripMode && mode != kFanMode) {
      ++model_.lines_and_points;
      return;
    }
    read_material(primitive, out);
    read_geometry(primitive, mode, out);
    for (const auto& triangle : out.triangles) {
      for (const std::uint32_t v : triangle)
        if (v >= out.positions.size()) throw InputError("a triangle uses a vertex that does not exist");
    }
    triangles_ += out.triangles.size() * points.size();
    vertices_ += out.positions.size() * points.size();
    if (triangles_ > kMaxTriangles || vertices_ > kMaxVertices)
      throw InputError(fmt::format("has more than {} triangles", kMaxTriangles));
    for (const Eigen::Matrix4d& position : points) {
      GltfPrimitive posed = out;
      for (Eigen::Vector3d& v : posed.positions)
        v = position.topLeftCorner<3, 3>() * v + position.topRightCorner<3, 1>();
      // A mirroring transform flips the sides (glTF 2.0, 3.7.4).
      if (position.topLeftCorner<3, 3>().determinant() < 0)
        for (auto& triangle : posed.triangles) std::swap(triangle[1], triangle[2]);
      model_.primitives.push_back(std::move(posed));
    }
  }

  void read_material(const Json& primitive, GltfPrimitive& out) const {
    if (!primitive.contains("material")) return;
    const Json& material = buffers_.item("materials", count_member(primitive, "material"));
    out.material = name_of(material);
    // Some programs make photographs emissive, so that lighting does not change them.
    const Json* base = material.find("pbrMetallicRoughness");
    if (material.contains("emissiveTexture") || (base != nullptr && base->contains("baseColorTexture")))
      out.pictured = true;
  }

  void read_geometry(const Json& primitive, std::uint64_t mode, GltfPrimitive& out) {
    const Json& attributes = primitive.at("attributes");
    if (attributes.contains("COLOR_0")) out.pictured = true;
    const std::string feature = feature_attribute(primitive, attributes, out);
    const Json& draco = extension(primitive, "KHR_draco_mesh_compression");
    if (draco.is_object()) {
      const Json& numbers = draco.at("attributes");
      const auto number = [&numbers](const std::string& key) {
        return numbers.contains(key)
                   ? static_cast<int>(std::min<std::uint64_t>(count_member(numbers, key), 1 << 30))
                   : -1;
      };
      DracoMesh mesh = unpack_draco(buffers_.view(count_member(draco, "bufferView")), number("POSITION"),
                                    feature.empty() ? -1 : number(feature));
      out.positions = std::move(mesh.positions);
      out.triangles = std::move(mesh.triangles);
      set_features(mesh.features, out);
      return;
    }
    const AccessorValues points = buffers_.accessor(count_member(attributes, "POSITION"));
    if (points.width != 3) throw InputError("positions are not of three numbers");
    out.positions.reserve(points.count);
    for (std::size_t i = 0; i < points.count; ++i) out.positions.emplace_back(&points.values[3 * i]);
    if (!feature.empty() && attributes.contains(feature)) {
      const AccessorValues ids = buffers_.accessor(count_member(attributes, feature));
      if (ids.width == 1) set_features(ids.values, out);
    }
    out.triangles = triangles_of(indices(primitive, out.positions.size()), mode);
  }

  std::vector<std::uint32_t> indices(const Json& primitive, std::size_t vertices) {
    std::vector<std::uint32_t> index;
    if (!primitive.contains("indices")) {
      index.resize(vertices);
      for (std::size_t i = 0; i < vertices; ++i) index[i] = static_cast<std::uint32_t>(i);
      return index;
    }
    const AccessorValues values = buffers_.accessor(count_member(primitive, "indices"));
    index.reserve(values.values.size());
    for (const double value : values.values) {
      if (!(value >= 0 && value < static_cast<double>(vertices)))
        throw InputError("a triangle uses a vertex that does not exist");
      index.push_back(static_cast<std::uint32_t>(value));
    }
    return index;
  }

  /// The attribute with feature ids, by EXT_mesh_features or as in a b3dm; empty without any.
  std::string feature_attribute(const Json& primitive, const Json& attributes, GltfPrimitive& out) {
    const Json* sets = extension(primitive, "EXT_mesh_features").find("featureIds");
    if (sets != nullptr && sets->is_array()) {
      for (const Json& set : *sets) {
        if (!set.contains("attribute")) continue;
        if (set.contains("propertyTable")) {
          out.table = static_cast<std::uint32_t>(
              std::min<std::uint64_t>(count_member(set, "propertyTable"), 1 << 20));
          read_table(*out.table);
        }
        return fmt::format("_FEATURE_ID_{}", count_member(set, "attribute"));
      }
    }
    for (const char* name : {"_BATCHID", "BATCHID"})
      if (attributes.contains(name)) return name;
    return {};
  }

  static void set_features(const std::vector<double>& ids, GltfPrimitive& out) {
    if (ids.size() != out.positions.size()) return;
    for (const double id : ids) {
      // Integers that were stored as floats.
      out.features.push_back(id >= 0 && id < 4e9 ? static_cast<std::uint32_t>(std::lround(id)) : 0);
    }
  }

  /// The text properties of property table `number` (EXT_structural_metadata).
  void read_table(std::uint32_t number) {
    if (model_.tables.count(number) > 0) return;
    auto& columns = model_.tables[number];
    const Json* tables = extension(asset_, "EXT_structural_metadata").find("propertyTables");
    if (tables == nullptr || !tables->is_array() || number >= tables->size()) return;
    const Json& table = (*tables)[number];
    const Json* properties = table.find("properties");
    if (properties == nullptr || !properties->is_object()) return;
    for (const Json::Member& member : properties->members()) {
      std::vector<std::string> texts = table_texts(member.value, count_member(table, "count"));
      if (!texts.empty()) columns[member.key] = std::move(texts);
    }
  }

  /// A text property; empty for one of another type, which has no offsets.
  std::vector<std::string> table_texts(const Json& property, std::uint64_t count) {
    std::vector<std::string> texts;
    if (!property.contains("stringOffsets")) return texts;
    const std::string type = text_member(property, "stringOffsetType");
    const std::size_t size = type == "UINT8" ? 1 : type == "UINT16" ? 2 : type == "UINT64" ? 8 : 4;
    const std::string_view offsets = buffers_.view(count_member(property, "stringOffsets"));
    const std::string_view values = buffers_.view(count_member(property, "values"));
    const auto offset = [&](std::uint64_t i) -> std::uint64_t {
      if (size == 1) return little<std::uint8_t>(offsets, i);
      if (size == 2) return little<std::uint16_t>(offsets, i * 2);
      if (size == 4) return little<std::uint32_t>(offsets, i * 4);
      return little<std::uint64_t>(offsets, i * 8);
    };
    if (count >= offsets.size()) throw InputError("a property table has more rows than offsets");
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint64_t begin = offset(i), end = offset(i + 1);
      if (end < begin) throw InputError("a property table's offsets do not increase");
      texts.emplace_back(piece(values, begin, end - begin).substr(0, 120));
    }
    return texts;
  }

  const Json& asset_;
  GltfBuffers buffers_;
  GltfModel model_;
  std::set<std::uint64_t> seen_, meshes_;  ///< nodes that were read, and their meshes
  std::size_t triangles_ = 0, vertices_ = 0, instances_ = 0;
};

}  // namespace

GltfModel read_gltf(std::string_view bytes, const FetchBytes& fetch) {
  const GltfParts parts = split_glb(bytes);
  const Json asset = Json::parse(parts.json);
  return GltfDecoder(asset, parts.binary, fetch).read();
}

}  // namespace canyon::meshes
