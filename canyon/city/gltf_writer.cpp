// Declared in canyon/city/mesh_export.hpp.
#include "canyon/city/mesh_export.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "canyon/base/arithmetic.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/city/boxes.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/city/mesh_parts.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::city {
namespace {

// Constants of the standard: componentType and bufferView.target.
constexpr int kFloat = 5126;
constexpr int kUnsignedInt = 5125;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;

void put_u32(std::string& out, std::uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) out += static_cast<char>(value >> shift & 0xFF);
}

void put_f32(std::string& out, float value) {
  put_u32(out, same_bytes<std::uint32_t>(value));
}

class GltfBuilder {
 public:
  explicit GltfBuilder(const City& city) : city_(city) {}

  void write(OutputFile& file) {
    header();
    const std::vector<Object> objects = objects_with_triangles(city_.mesh);
    const std::vector<std::string> names = node_names(objects, NameCharacters::Utf8);
    Json children = Json::array();
    for (std::size_t i = 0; i < objects.size(); ++i) {
      children.push_back(i + 1);
      add(objects[i], names[i]);
    }
    json_["nodes"][0]["children"] = std::move(children);
    json_["bufferViews"] = {
        {{"buffer", 0}, {"byteOffset", 0}, {"byteLength", positions_.size()}, {"target", kArrayBuffer}},
        {{"buffer", 0},
         {"byteOffset", positions_.size()},
         {"byteLength", indices_.size()},
         {"target", kElementArrayBuffer}}};
    const std::size_t binary = positions_.size() + indices_.size();  // whole numbers of 4 bytes each
    json_["buffers"] = {{{"byteLength", binary}}};
    std::string text = json_.dump();
    text.append((4 - text.size() % 4) % 4, ' ');
    const std::uint64_t total = 12 + 8 + text.size() + 8 + binary;
    if (total > std::numeric_limits<std::uint32_t>::max()) {
      throw InputError(file.path(), 0, "the city takes more than the 4 GiB that a .glb file can hold",
                       "write .canyon or .obj");
    }
    std::string chunk = "glTF";
    put_u32(chunk, 2);
    put_u32(chunk, static_cast<std::uint32_t>(total));
    put_u32(chunk, static_cast<std::uint32_t>(text.size()));
    file.write(chunk + "JSON");
    file.write(text);
    chunk.clear();
    put_u32(chunk, static_cast<std::uint32_t>(binary));
    file.write(chunk + std::string("BIN\0", 4));
    file.write(positions_);
    file.write(indices_);
  }

 private:
  void header() {
    const geodesy::Geodetic& origin = city_.frame.origin();
    // The mark first: a reader looks for it near the beginning.
    json_["asset"] = {{"version", "2.0"},
                      {"generator", std::string(kMeshMark)},
                      {"extras",
                       {{"name", city_.name},
                        {"origin",
                         {{"latitude_deg", geodesy::degrees(origin.latitude_rad)},
                          {"longitude_deg", geodesy::degrees(origin.longitude_rad)},
                          {"height_m", origin.height_m}}}}}};
    json_["scene"] = 0;
    json_["scenes"] = {{{"nodes", {0}}}};
    json_["nodes"] = Json::array({{{"name", "city"}}});
    json_["meshes"] = Json::array();
    json_["accessors"] = Json::array();
    json_["materials"] = Json::array();
    for (const Material material : materials_of(city_.mesh)) {
      const auto [r, g, b] = material_colour(material);
      material_index_[static_cast<std::size_t>(material)] = json_["materials"].size();
      json_["materials"].push_back({{"name", std::string(material_name(material))},
                                    {"pbrMetallicRoughness",
                                     {{"baseColorFactor", {r, g, b, 1.0}},
                                      {"metallicFactor", material == Material::Metal ? 0.8 : 0.0},
                                      {"roughnessFactor", material == Material::Glass ? 0.2 : 0.9}}}});
    }
  }

  void add(const Object& object, const std::string& name) {
    Box box;
    extend(box, city_.mesh, object);
    // Whole metres are exact in single precision.
    const Eigen::Vector3d middle = middle_of(box).array().round();
    const MeshPart part = mesh_part(city_.mesh, object, middle);

    std::array<float, 3> low{};
    std::array<float, 3> high{};
    low.fill(std::numeric_limits<float>::max());
    high.fill(std::numeric_limits<float>::lowest());
    const std::size_t first = positions_.size();
    for (const Eigen::Vector3d& v : part.vertices) {
      const std::array<float, 3> p{static_cast<float>(v.x()), static_cast<float>(v.z()),
                                   static_cast<float>(-v.y())};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], p[axis]);
        high[axis] = std::max(high[axis], p[axis]);
        put_f32(positions_, p[axis]);
      }
    }
    Json& accessors = json_["accessors"];
    const std::size_t position = accessors.size();
    accessors.push_back({{"bufferView", 0},
                         {"byteOffset", first},
                         {"componentType", kFloat},
                         {"count", part.vertices.size()},
                         {"type", "VEC3"},
                         {"min", {low[0], low[1], low[2]}},
                         {"max", {high[0], high[1], high[2]}}});
    Json primitives = Json::array();
    for (const MaterialGroup& group : part.groups) {
      primitives.push_back({{"attributes", {{"POSITION", position}}},
                            {"indices", accessors.size()},
                            {"material", material_index_[static_cast<std::size_t>(group.material)]}});
      accessors.push_back({{"bufferView", 1},
                           {"byteOffset", indices_.size()},
                           {"componentType", kUnsignedInt},
                           {"count", 3 * group.triangles.size()},
                           {"type", "SCALAR"}});
      for (const auto& triangle : group.triangles) {
        for (const std::uint32_t v : triangle) put_u32(indices_, v);
      }
    }
    json_["nodes"].push_back({{"name", name},
                              {"mesh", json_["meshes"].size()},
                              {"translation", {middle.x(), middle.z(), 0.0 - middle.y()}}});
    json_["meshes"].push_back({{"name", name}, {"primitives", std::move(primitives)}});
  }

  const City& city_;
  Json json_;
  std::string positions_;
  std::string indices_;
  std::array<std::size_t, 256> material_index_{};
};

}  // namespace

void write_glb(OutputFile& file, const City& city) {
  GltfBuilder(city).write(file);
}

}  // namespace canyon::city
