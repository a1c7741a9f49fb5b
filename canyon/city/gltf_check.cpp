// Declared in canyon/city/mesh_file_format.hpp.
// check_gltf(). Format: Khronos, glTF 2.0 specification.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/base64.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/city/mesh_file_format.hpp"

namespace canyon::city {
namespace {

constexpr std::string_view kGltfDamaged = "export or copy it again: it is damaged";
constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

std::uint32_t word_at(std::string_view bytes, std::size_t at) {
  const auto byte = [&](std::size_t i) { return std::uint32_t{static_cast<unsigned char>(bytes[at + i])}; };
  return byte(0) | byte(1) << 8U | byte(2) << 16U | byte(3) << 24U;
}

class GltfCheck {
 public:
  explicit GltfCheck(const std::filesystem::path& path) : path_(path) {}

  std::vector<std::string> check() {
    std::ifstream in(path_, std::ios::binary);
    std::string text(std::istreambuf_iterator<char>(in), {});
    constexpr std::size_t kHeader = 20;  // of GLB: 12 bytes, then length and type of the JSON chunk
    if (text.size() > kHeader && text.compare(0, 4, "glTF") == 0) {
      // 4.4.2: the whole length, of all chunks.
      if (const std::size_t whole = word_at(text, 8); whole != text.size())
        throw fault(fmt::format("has {} bytes where its header says {}", text.size(), whole));
      if (const std::uint32_t version = word_at(text, 4); version != 2) throw other_version(version);
      const std::size_t length = word_at(text, 12);
      if (length > text.size() - kHeader)
        throw fault(fmt::format("promises {} bytes of JSON of {}", length, text.size() - kHeader));
      if (kHeader + length + 8 <= text.size()) bin_ = text.substr(kHeader + length + 8);
      text = text.substr(kHeader, length);
    }
    const std::optional<Json> root = Json::try_parse(text);
    if (!root || !root->is_object()) return {};  // Assimp says the rest
    root_ = &*root;
    check_version();
    check_extensions();
    if (list("extensions").contains("CESIUM_RTC")) {
      notes_.emplace_back("its place on the Earth (CESIUM_RTC) is not read: the city stands at city.origin");
    }
    try {
      check_meshes();
      check_nodes();
    } catch (const JsonError& error) {
      throw InputError(path_, 0, fmt::format("is not as glTF 2.0 has it ({})", error.what()), kGltfDamaged);
    }
    return std::move(notes_);
  }

 private:
  [[nodiscard]] InputError fault(const std::string& what) const { return {path_, 0, what, kGltfDamaged}; }

  template <typename Version>
  [[nodiscard]] InputError other_version(const Version& version) const {
    return {path_, 0, fmt::format("is glTF of version {}, and 2.0 is read", version),
            "export it as glTF 2.0"};
  }

  /// 5.9: "minVersion" is what a reader must know.
  void check_version() const {
    const Json& asset = list("asset");
    if (!asset.is_object()) return;
    for (const char* key : {"minVersion", "version"}) {
      const Json* version = asset.find(key);
      if (version == nullptr || !version->is_string()) continue;
      if (!version->text().starts_with("2.") || (key[0] == 'm' && version->text() != "2.0"))
        throw other_version(version->text());
    }
  }

  [[nodiscard]] const Json& list(const char* key) const { return (*root_)[key]; }

  /// The whole number of a member; `otherwise` where it has none.
  static std::size_t number(const Json& object, const char* key, std::size_t otherwise) {
    const Json* found = object.find(key);
    if (found == nullptr) return otherwise;
    if (!found->is_integer() || found->get<std::int64_t>() < 0)
      throw JsonError(fmt::format("\"{}\" is not a whole number", key));
    return found->get<std::size_t>();
  }

  const Json& item(const char* key, std::size_t index) {
    const Json& items = list(key);
    if (!items.is_array() || index >= items.size())
      throw fault(
          fmt::format("names number {} of its {} {}", index, items.is_array() ? items.size() : 0, key));
    used_[key].insert(index);
    return items[index];
  }

  void check_extensions() {
    if (!list("extensionsRequired").is_array()) return;
    for (const Json& each : list("extensionsRequired").items()) {
      const std::string name = each.is_string() ? each.text() : "";
      const auto only_looks = [&name](std::string_view kind) { return name.substr(4).starts_with(kind); };
      if (name.size() > 4 && (only_looks("materials_") || only_looks("texture_") || only_looks("lights_") ||
                              only_looks("xmp"))) {
        continue;
      }
      throw InputError(path_, 0, fmt::format("requires the extension {}, which is not read here", name),
                       "export the mesh without compression and quantization");
    }
  }

  struct Accessor {
    std::size_t count = 0, stride = 0, components = 0, type = 0;
    std::string_view bytes;  ///< from its first element on; empty where they are not at hand
  };

  /// The bytes of a buffer; empty for a file that is not there, which Assimp says.
  std::string_view buffer(std::size_t index) {
    const auto [found, fresh] = buffers_.try_emplace(index);
    if (!fresh) return found->second;
    const Json& buffer = item("buffers", index);
    const std::size_t length = number(buffer, "byteLength", 0);
    const Json& uri = buffer["uri"];
    if (!uri.is_string()) {
      found->second = bin_;
    } else if (uri.text().starts_with("data:")) {
      const auto bytes = from_base64(std::string_view(uri.text()).substr(uri.text().find(',') + 1));
      if (!bytes) throw fault(fmt::format("buffer {} is not base64", index));
      found->second = *bytes;
    } else {
      const std::filesystem::path file = path_.parent_path() / uri.text();
      if (!check_companion(file)) return {};
      std::ifstream in(file, std::ios::binary);
      found->second.assign(std::istreambuf_iterator<char>(in), {});
    }
    if (found->second.size() < length)
      throw fault(fmt::format("buffer {} has {} of {} bytes", index, found->second.size(), length));
    return found->second;
  }

  Accessor accessor(std::size_t index) {
    const Json& json = item("accessors", index);
    know(
        json, "accessors",
        {"bufferView", "byteOffset", "componentType", "normalized", "count", "type", "max", "min", "sparse"});
    static const std::map<std::size_t, std::size_t> kSizes{{5120, 1}, {5121, 1}, {5122, 2},
                                                           {5123, 2}, {5125, 4}, {5126, 4}};
    static const std::map<std::string, std::size_t> kComponents{
        {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}};
    Accessor result;
    result.type = number(json, "componentType", 0);
    const auto size = kSizes.find(result.type);
    const auto components = kComponents.find(json.at("type").text());
    if (size == kSizes.end() || components == kComponents.end())
      throw fault(fmt::format("accessor {} has a type that glTF does not have", index));
    result.count = number(json, "count", 0);
    result.components = components->second;
    const std::size_t bytes = size->second * result.components;
    const std::size_t view_index = number(json, "bufferView", kNone);
    if (view_index == kNone) return result;
    const Json& view = item("bufferViews", view_index);
    know(view, "bufferViews", {"buffer", "byteOffset", "byteLength", "byteStride", "target"});
    result.stride = number(view, "byteStride", bytes);
    const std::size_t first = number(json, "byteOffset", 0), length = number(view, "byteLength", 0);
    const std::size_t most = std::size_t{1} << 40;
    if (first > length || result.stride > most || result.count > most ||
        (result.count > 0 && first + result.stride * (result.count - 1) + bytes > length)) {
      throw fault(fmt::format("accessor {} reaches beyond its buffer view of {} bytes", index, length));
    }
    const std::size_t end = result.count > 0 ? first + result.stride * (result.count - 1) + bytes : first;
    std::size_t& taken = taken_.try_emplace(view_index, 0).first->second;
    taken = std::max(taken, end);
    const std::string_view whole = buffer(number(view, "buffer", kNone));
    if (whole.empty()) return result;
    const std::size_t offset = number(view, "byteOffset", 0);
    if (offset > whole.size() || length > whole.size() - offset)
      throw fault(fmt::format("buffer view {} reaches beyond its buffer", view_index));
    if (!json.contains("sparse")) result.bytes = whole.substr(offset + first);
    return result;
  }

  /// Positions are finite and fill the bounds that the file states of them (glTF 2.0, 3.6.2.5).
  std::size_t check_positions(std::size_t index) {
    const Accessor positions = accessor(index);
    constexpr std::size_t kFloat = 5126;
    if (positions.bytes.empty() || positions.type != kFloat || positions.components != 3)
      return positions.count;
    std::array<double, 3> low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
    for (std::size_t i = 0; i < positions.count; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        float value = 0;
        std::memcpy(&value, positions.bytes.data() + i * positions.stride + 4 * k, sizeof value);
        if (!std::isfinite(value)) throw fault(fmt::format("accessor {} has a coordinate {}", index, value));
        low[k] = std::min<double>(low[k], value);
        high[k] = std::max<double>(high[k], value);
      }
    }
    const Json& json = list("accessors")[index];
    const auto agrees = [&](const char* key, const std::array<double, 3>& found) {
      const Json& stated = json[key];
      if (!stated.is_array() || stated.size() != 3 || positions.count == 0) return true;
      for (std::size_t k = 0; k < 3; ++k) {
        const double tolerance = 1e-3 * std::max(high[k] - low[k], 1e-3) + 1e-5 * std::abs(found[k]);
        if (!(std::abs(stated[k].get<double>() - found[k]) <= tolerance)) return false;
      }
      return true;
    };
    if (!agrees("min", low) || !agrees("max", high))
      notes_.push_back(
          fmt::format("the positions of accessor {} do not fill the bounds stated of them: damaged?", index));
    return positions.count;
  }

  void check_indices(std::size_t index, std::size_t vertices) {
    const Accessor indices = accessor(index);
    const std::size_t size = indices.type == 5125 ? 4 : indices.type == 5123 ? 2 : 1;
    for (std::size_t i = 0; !indices.bytes.empty() && i < indices.count; ++i) {
      std::uint32_t value = 0;
      for (std::size_t byte = size; byte-- > 0;)
        value = value << 8U | static_cast<unsigned char>(indices.bytes[i * indices.stride + byte]);
      if (value >= vertices)
        throw fault(fmt::format("accessor {} names vertex {} of {}", index, value, vertices));
    }
  }

  void check_meshes() {
    for (const Json& mesh : list("meshes")) {
      know(mesh, "meshes", {"primitives", "weights"});
      for (const Json& primitive : mesh["primitives"]) {
        know(primitive, "primitives", {"attributes", "indices", "material", "mode", "targets"});
        const Json& attributes = primitive.at("attributes");
        if (!attributes.contains("POSITION")) throw fault("has a primitive without POSITION");
        for (const auto& [key, value] : attributes.members()) item("accessors", value.get<std::size_t>());
        for (const Json& target : primitive["targets"])
          for (const auto& [key, value] : target.members()) item("accessors", value.get<std::size_t>());
        const std::size_t vertices = check_positions(number(attributes, "POSITION", kNone));
        if (primitive.contains("indices")) check_indices(number(primitive, "indices", kNone), vertices);
      }
    }
  }

  void check_nodes() {
    if (list("scenes").size() > 0) {
      for (const Json& node : item("scenes", number(*root_, "scene", 0))["nodes"])
        visit_node(node.get<std::size_t>());
    }
    if (list("scenes").size() > 1)
      notes_.push_back(
          fmt::format("the scene {} of {} is read", number(*root_, "scene", 0), list("scenes").size()));
    if (repeated_ > 0) {
      notes_.push_back(fmt::format(
          "{} nodes stand at many places by EXT_mesh_gpu_instancing, which is not read: each is built once; "
          "export the instances as nodes",
          repeated_));
    }
    if (hidden_ > 0)
      notes_.push_back(fmt::format("{} nodes are hidden by KHR_node_visibility, and are built", hidden_));
    const auto count_unused = [&](const char* key, std::string_view what) {
      const std::size_t all = list(key).is_array() ? list(key).size() : 0, unused = all - used_[key].size();
      if (unused > 0) notes_.push_back(fmt::format("{} of {} {} {}", unused, all, key, what));
    };
    count_unused("meshes", "are not in the scene and left out");
    if (!root_->contains("animations") && !root_->contains("skins") && !root_->contains("extensionsUsed"))
      count_unused("accessors", "belong to nothing: damaged?");
    for (const auto& [view, taken] : taken_) {
      const Json& json = list("bufferViews")[view];
      if (taken + std::max<std::size_t>(4, number(json, "byteStride", 0)) <= number(json, "byteLength", 0))
        notes_.push_back(fmt::format("the end of buffer view {} belongs to nothing: damaged?", view));
    }
    for (const auto& [what, count] : unknown_)
      notes_.push_back(fmt::format("{} of its {} is not of glTF 2.0 and is passed over", what, count));
  }

  void visit_node(std::size_t index) {
    if (used_["nodes"].count(index) > 0) return;
    const Json& node = item("nodes", index);
    know(node, "nodes",
         {"camera", "children", "skin", "matrix", "mesh", "rotation", "scale", "translation", "weights"});
    check_transform(node, index);
    if (const std::size_t mesh = number(node, "mesh", kNone); mesh != kNone) item("meshes", mesh);
    const Json& extensions = node["extensions"];
    repeated_ += extensions.contains("EXT_mesh_gpu_instancing") ? 1U : 0U;
    hidden_ += extensions["KHR_node_visibility"]["visible"] == false ? 1U : 0U;
    for (const Json& child : node["children"]) visit_node(child.get<std::size_t>());
  }

  /// The numbers of a node's member; none where it does not have it. Assimp passes over others than `size`.
  [[nodiscard]] std::vector<double> numbers(const Json& node, std::size_t index, const char* key,
                                            std::size_t size) const {
    std::vector<double> values;
    const Json* member = node.find(key);
    if (member == nullptr) return values;
    if (member->is_array())
      for (const Json& value : member->items()) values.push_back(value.get<double>());
    if (values.size() != size)
      throw node_fault(node, index, fmt::format("a {} that is not {} numbers", key, size));
    return values;
  }

  [[nodiscard]] InputError node_fault(const Json& node, std::size_t index, const std::string& what) const {
    const Json& name = node["name"];
    return {path_, 0, fmt::format("node {} '{}' has {}", index, name.is_string() ? name.text() : "", what),
            "export it again: glTF 2.0 does not allow it"};
  }

  /// glTF 2.0, 3.5.3 and 5.25: a matrix or its three parts, an affine matrix, a rotation by a unit
  /// quaternion. Assimp takes any numbers and distorts the mesh.
  void check_transform(const Json& node, std::size_t index) const {
    const std::vector<double> matrix = numbers(node, index, "matrix", 16);
    const std::vector<double> q = numbers(node, index, "rotation", 4);
    const bool moved = !numbers(node, index, "translation", 3).empty();
    const bool scaled = !numbers(node, index, "scale", 3).empty();
    if (!matrix.empty() && (moved || scaled || !q.empty()))
      throw node_fault(node, index, "a matrix beside a translation, rotation or scale");
    if (!matrix.empty() && (matrix[3] != 0 || matrix[7] != 0 || matrix[11] != 0 || matrix[15] != 1))
      throw node_fault(node, index, "a matrix whose last row is not 0 0 0 1");
    if (q.empty()) return;
    constexpr double kTolerance = 5e-4;  // numbers of three decimals; stretches by 0.1 % at most
    const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
    if (!(std::abs(length - 1) <= kTolerance)) {
      throw node_fault(
          node, index,
          fmt::format("a rotation that is not a unit quaternion (its length is {:.4g})", length));
    }
  }

  void know(const Json& object, const char* what, std::initializer_list<std::string_view> keys) {
    for (const auto& [key, value] : object.members()) {
      if (key == "name" || key == "extensions" || key == "extras") continue;
      if (std::find(keys.begin(), keys.end(), key) == keys.end()) unknown_[fmt::format("\"{}\"", key)] = what;
    }
  }

  const std::filesystem::path& path_;
  const Json* root_ = nullptr;
  std::string bin_;
  std::map<std::size_t, std::string> buffers_;
  std::map<std::string, std::set<std::size_t>> used_;  ///< by list
  std::map<std::size_t, std::size_t> taken_;           ///< bytes of buffer views that accessors take
  std::map<std::string, std::string> unknown_;         ///< keys, and whose they are
  std::size_t repeated_ = 0, hidden_ = 0;              ///< nodes
  std::vector<std::string> notes_;
};

}  // namespace

std::vector<std::string> check_gltf(const std::filesystem::path& path) {
  return GltfCheck(path).check();
}

}  // namespace canyon::city
