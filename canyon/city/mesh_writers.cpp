// Declared in canyon/city/mesh_export.hpp.
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/payload.hpp"
#include "canyon/base/utf8.hpp"
#include "canyon/city/mesh_export.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/city/mesh_parts.hpp"
#include "canyon/city/mesh_topology.hpp"

namespace canyon::city {
namespace {

class ColladaWriter {
 public:
  ColladaWriter(OutputFile& file, const Mesh& mesh, const Eigen::Vector3d& origin)
      : file_(file), mesh_(mesh), origin_(origin) {}

  void write(const std::vector<ColladaNode>& nodes, const std::string& title, const std::string& comment,
             bool marked) {
    asset(title, comment, marked);
    materials();
    text("  <library_geometries>\n");
    for (std::size_t i = 0; i < nodes.size(); ++i) geometry(i, nodes[i]);
    text(
        "  </library_geometries>\n  <library_visual_scenes>\n    <visual_scene id=\"scene\" "
        "name=\"scene\">\n");
    for (std::size_t i = 0; i < nodes.size(); ++i) node(i, nodes[i].name);
    text("    </visual_scene>\n  </library_visual_scenes>\n");
    text("  <scene><instance_visual_scene url=\"#scene\"/></scene>\n</COLLADA>\n");
    flush();
  }

 private:
  void text(std::string_view piece) { out_.append(piece.data(), piece.data() + piece.size()); }
  template <typename... Values>
  void line(const char* format, const Values&... values) {
    fmt::vformat_to(std::back_inserter(out_), format, fmt::make_format_args(values...));
  }
  void flush() {
    file_.write({out_.data(), out_.size()});
    out_.clear();
  }

  void asset(const std::string& title, const std::string& comment, bool marked) {
    text("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    text("<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n  <asset>\n");
    line(
        "    <contributor><authoring_tool>Canyon</authoring_tool><comments>{}{}{}</comments></contributor>\n",
        marked ? kMeshMark : "", marked ? ". " : "", xml_escaped(comment));
    // The standard asks for times; these are constant so that the same city gives the same bytes.
    text("    <created>1980-01-06T00:00:00Z</created>\n    <modified>1980-01-06T00:00:00Z</modified>\n");
    line("    <title>{}</title>\n", xml_escaped(title));
    text("    <unit name=\"meter\" meter=\"1\"/>\n    <up_axis>Z_UP</up_axis>\n  </asset>\n");
  }

  void materials() {
    const std::vector<Material> all = materials_of(mesh_);
    text("  <library_effects>\n");
    for (const Material material : all) {
      const auto [r, g, b] = material_colour(material);
      line(
          "    <effect id=\"{0}-effect\"><profile_COMMON><technique sid=\"common\"><lambert>\n"
          "      <emission><color>0 0 0 1</color></emission>\n"
          "      <ambient><color>{1} {2} {3} 1</color></ambient>\n"
          "      <diffuse><color>{1} {2} {3} 1</color></diffuse>\n"
          "    </lambert></technique></profile_COMMON></effect>\n",
          material_name(material), r, g, b);
    }
    text("  </library_effects>\n  <library_materials>\n");
    for (const Material material : all) {
      line("    <material id=\"{0}\" name=\"{0}\"><instance_effect url=\"#{0}-effect\"/></material>\n",
           material_name(material));
    }
    text("  </library_materials>\n");
  }

  void source(std::size_t number, const char* what, const std::vector<Eigen::Vector3d>& points) {
    line("      <source id=\"g{0}-{1}\">\n        <float_array id=\"g{0}-{1}-array\" count=\"{2}\">", number,
         what, 3 * points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        if (i > 0 || axis > 0) out_.push_back(axis == 0 ? '\n' : ' ');
        append_metres(out_, points[i][axis]);
      }
    }
    line(
        "</float_array>\n        <technique_common><accessor source=\"#g{0}-{1}-array\" count=\"{2}\" "
        "stride=\"3\"><param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/><param name=\"Z\" "
        "type=\"float\"/></accessor></technique_common>\n      </source>\n",
        number, what, points.size());
  }

  void geometry(std::size_t number, const ColladaNode& node) {
    const MeshPart part = mesh_part(mesh_, node.objects, origin_);
    std::vector<Eigen::Vector3d> normals;
    for (const MaterialGroup& group : part.groups) {
      for (const auto& triangle : group.triangles)
        normals.push_back(normal_of(part.vertices, triangle).normalized());
    }
    line("    <geometry id=\"g{}\" name=\"{}\"><mesh>\n", number, node.name);
    source(number, "positions", part.vertices);
    source(number, "normals", normals);
    line(
        "      <vertices id=\"g{0}-vertices\"><input semantic=\"POSITION\" source=\"#g{0}-positions\"/>"
        "</vertices>\n",
        number);
    std::size_t normal = 0;
    for (const MaterialGroup& group : part.groups) {
      line(
          "      <triangles material=\"{1}\" count=\"{2}\">\n"
          "        <input semantic=\"VERTEX\" source=\"#g{0}-vertices\" offset=\"0\"/>\n"
          "        <input semantic=\"NORMAL\" source=\"#g{0}-normals\" offset=\"1\"/>\n        <p>",
          number, material_name(group.material), group.triangles.size());
      for (std::size_t t = 0; t < group.triangles.size(); ++t, ++normal) {
        const auto& [a, b, c] = group.triangles[t];
        line("{0}{1} {4} {2} {4} {3} {4}", t == 0 ? "" : "\n", a, b, c, normal);
      }
      text("</p>\n      </triangles>\n");
    }
    text("    </mesh></geometry>\n");
    used_.push_back({});
    for (const MaterialGroup& group : part.groups) used_.back().push_back(group.material);
    if (out_.size() > kFlushBytes) flush();
  }

  void node(std::size_t number, const std::string& name) {
    line(
        "      <node id=\"n{0}\" name=\"{1}\" type=\"NODE\"><instance_geometry url=\"#g{0}\"><bind_material>"
        "<technique_common>",
        number, name);
    for (const Material material : used_[number]) {
      line("<instance_material symbol=\"{0}\" target=\"#{0}\"/>", material_name(material));
    }
    text("</technique_common></bind_material></instance_geometry></node>\n");
    if (out_.size() > kFlushBytes) flush();
  }

  OutputFile& file_;
  const Mesh& mesh_;
  Eigen::Vector3d origin_;
  fmt::memory_buffer out_;
  std::vector<std::vector<Material>> used_;  ///< by each geometry
};

}  // namespace

void write_collada(OutputFile& file, const Mesh& mesh, const std::vector<ColladaNode>& nodes,
                   const std::string& title, const std::string& comment, bool marked,
                   const Eigen::Vector3d& origin) {
  ColladaWriter(file, mesh, origin).write(nodes, title, comment, marked);
}

namespace {

// Constants of the standard: componentType and bufferView.target.
constexpr int kFloat = 5126;
constexpr int kUnsignedInt = 5125;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;

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
    json_["bufferViews"] = {{{"buffer", 0},
                             {"byteOffset", 0},
                             {"byteLength", positions_.bytes().size()},
                             {"target", kArrayBuffer}},
                            {{"buffer", 0},
                             {"byteOffset", positions_.bytes().size()},
                             {"byteLength", indices_.bytes().size()},
                             {"target", kElementArrayBuffer}}};
    const std::size_t binary =
        positions_.bytes().size() + indices_.bytes().size();  // whole numbers of 4 bytes each
    json_["buffers"] = {{{"byteLength", binary}}};
    std::string text = json_.dump();
    text.append((4 - text.size() % 4) % 4, ' ');
    const std::uint64_t total = 12 + 8 + text.size() + 8 + binary;
    if (total > std::numeric_limits<std::uint32_t>::max()) {
      throw InputError(file.path(), 0, "the city takes more than the 4 GiB that a .glb file can hold",
                       "write .canyon or .obj");
    }
    Payload head;
    file.write(head.raw("glTF")
                   .u4(2)
                   .u4(total)
                   .u4(text.size())
                   .raw("JSON")
                   .raw(text)
                   .u4(binary)
                   .text("BIN", 4)
                   .bytes());
    file.write(positions_.bytes());
    file.write(indices_.bytes());
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
    const std::size_t first = positions_.bytes().size();
    for (const Eigen::Vector3d& v : part.vertices) {
      const std::array<float, 3> p{static_cast<float>(v.x()), static_cast<float>(v.z()),
                                   static_cast<float>(-v.y())};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], p[axis]);
        high[axis] = std::max(high[axis], p[axis]);
        positions_.r4(p[axis]);
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
                           {"byteOffset", indices_.bytes().size()},
                           {"componentType", kUnsignedInt},
                           {"count", 3 * group.triangles.size()},
                           {"type", "SCALAR"}});
      for (const auto& triangle : group.triangles) {
        for (const std::uint32_t v : triangle) indices_.u4(v);
      }
    }
    json_["nodes"].push_back({{"name", name},
                              {"mesh", json_["meshes"].size()},
                              {"translation", {middle.x(), middle.z(), 0.0 - middle.y()}}});
    json_["meshes"].push_back({{"name", name}, {"primitives", std::move(primitives)}});
  }

  const City& city_;
  Json json_;
  Payload positions_, indices_;
  std::array<std::size_t, 256> material_index_{};
};

}  // namespace

void write_glb(OutputFile& file, const City& city) {
  GltfBuilder(city).write(file);
}

}  // namespace canyon::city
