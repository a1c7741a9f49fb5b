#include "canyon/city/mesh_export.hpp"
#include "canyon/city/mesh_parts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <string_view>
#include <system_error>
#include <unordered_map>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/payload.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/mesh_marks.hpp"

namespace canyon::city {
namespace {

std::string origin_line(const City& city) {
  const geodesy::Geodetic& origin = city.frame.origin();
  return fmt::format("east-north-up about latitude {:.9f} deg, longitude {:.9f} deg, height {:.4f} m",
                     geodesy::degrees(origin.latitude_rad), geodesy::degrees(origin.longitude_rad),
                     origin.height_m);
}

/// The text as a one-line comment.
std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; }, ' ');
  return text;
}

void write_mtl(OutputFile& file, const City& city) {
  std::string text = "# Materials of a Canyon city\n";
  for (const Material material : materials_of(city.mesh)) {
    const auto [r, g, b] = material_colour(material);
    text += fmt::format("\nnewmtl {0}\nKa {1} {2} {3}\nKd {1} {2} {3}\nKs 0 0 0\nd 1\nillum 1\n",
                        material_name(material), r, g, b);
  }
  file.write(text);
}

void write_obj(OutputFile& file, const City& city, const std::string& library) {
  const std::vector<Object> objects = objects_with_triangles(city.mesh);
  const std::vector<std::string> names = node_names(objects, NameCharacters::Word);
  fmt::memory_buffer out;
  const auto to = [&out] { return std::back_inserter(out); };
  fmt::format_to(to(), "# {}\n# {}\n# {}; z up, metres\nmtllib {}\n", kMeshMark, one_line(city.name),
                 origin_line(city), library);
  std::size_t first = 1;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const MeshPart part = mesh_part(city.mesh, objects[i]);
    fmt::format_to(to(), "o {}\n", names[i]);
    for (const Eigen::Vector3d& v : part.vertices) {
      out.push_back('v');
      for (int axis = 0; axis < 3; ++axis) {
        out.push_back(' ');
        append_metres(out, v[axis]);
      }
      out.push_back('\n');
    }
    for (const MaterialGroup& group : part.groups) {
      fmt::format_to(to(), "usemtl {}\n", material_name(group.material));
      for (const auto& [a, b, c] : group.triangles)
        fmt::format_to(to(), "f {} {} {}\n", first + a, first + b, first + c);
    }
    first += part.vertices.size();
    if (out.size() > kFlushBytes) {
      file.write({out.data(), out.size()});
      out.clear();
    }
  }
  file.write({out.data(), out.size()});
}

void write_obj_and_mtl(OutputFile& obj, const City& city) {
  std::filesystem::path library = obj.path();
  library.replace_extension(".mtl");
  const std::string name = library.filename().string();
  if (one_line(name) != name) {
    throw InputError(obj.path(), 0, "its name has a line break or other control character",
                     "OBJ names its materials' file: choose a plain name");
  }
  OutputFile mtl(library);
  write_mtl(mtl, city);
  write_obj(obj, city, name);
  mtl.commit();
  obj.commit();
}

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
    // The standard requires times; these are constant so that the same city gives the same bytes.
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
    for (const MaterialGroup& group : part.groups)
      for (const auto& triangle : group.triangles)
        normals.push_back(normal_of(part.vertices, triangle).normalized());
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
    for (const Material material : used_[number])
      line("<instance_material symbol=\"{0}\" target=\"#{0}\"/>", material_name(material));
    text("</technique_common></bind_material></instance_geometry></node>\n");
    if (out_.size() > kFlushBytes) flush();
  }

  OutputFile& file_;
  const Mesh& mesh_;
  Eigen::Vector3d origin_;
  fmt::memory_buffer out_;
  std::vector<std::vector<Material>> used_;  ///< by geometry
};

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
        positions_.bytes().size() + indices_.bytes().size();  // integers of 4 bytes each
    json_["buffers"] = {{{"byteLength", binary}}};
    std::string text = json_.dump();
    text.append((4 - text.size() % 4) % 4, ' ');
    const std::uint64_t total = 12 + 8 + text.size() + 8 + binary;
    if (total > std::numeric_limits<std::uint32_t>::max()) {
      throw InputError(file.path(), 0, "the city needs more than the 4 GiB limit of a .glb file",
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
    // The mark first: readers search for it near the beginning.
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
      for (const auto& triangle : group.triangles)
        for (const std::uint32_t v : triangle) indices_.u4(v);
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

void write_mesh(const std::filesystem::path& path, const City& city) {
  const std::string extension = lower_case(path.extension().string());
  if (extension != ".glb" && extension != ".obj" && extension != ".dae")
    throw InputError(path, 0, fmt::format("unknown mesh format '{}'", extension), "use .glb, .obj or .dae");
  check_mesh(city.mesh, city.name);
  if (city.mesh.triangles.empty()) throw InputError(path, 0, "the city has no triangle to write");
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) throw InputError(path, 0, "is a folder");
  OutputFile file(path);
  if (extension == ".obj") {
    write_obj_and_mtl(file, city);
    return;
  }
  if (extension == ".glb") {
    write_glb(file, city);
  } else {
    const std::vector<Object> objects = objects_with_triangles(city.mesh);
    const std::vector<std::string> names = node_names(objects, NameCharacters::XmlName);
    std::vector<ColladaNode> nodes;
    nodes.reserve(objects.size());
    for (std::size_t i = 0; i < objects.size(); ++i) nodes.push_back({names[i], {objects[i]}});
    write_collada(file, city.mesh, nodes, city.name, origin_line(city), true);
  }
  file.commit();
}

MeshPart mesh_part(const Mesh& mesh, const std::vector<Object>& objects, const Eigen::Vector3d& origin) {
  MeshPart part;
  std::unordered_map<std::uint32_t, std::uint32_t> index_of;
  std::array<int, 256> group_of{};
  group_of.fill(-1);
  for (const Object& object : objects) {
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
      int& group = group_of[static_cast<std::uint8_t>(mesh.materials[t])];
      if (group < 0) {
        group = static_cast<int>(part.groups.size());
        part.groups.push_back({mesh.materials[t], {}});
      }
      std::array<std::uint32_t, 3> triangle{};
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const std::uint32_t vertex = mesh.triangles[t][corner];
        const auto [found, added] =
            index_of.try_emplace(vertex, static_cast<std::uint32_t>(part.vertices.size()));
        if (added) part.vertices.emplace_back(mesh.vertices[vertex] - origin);
        triangle[corner] = found->second;
      }
      part.groups[static_cast<std::size_t>(group)].triangles.push_back(triangle);
    }
  }
  return part;
}

MeshPart mesh_part(const Mesh& mesh, const Object& object, const Eigen::Vector3d& origin) {
  return mesh_part(mesh, std::vector<Object>{object}, origin);
}

std::vector<Object> objects_with_triangles(const Mesh& mesh) {
  std::vector<Object> objects;
  std::copy_if(mesh.objects.begin(), mesh.objects.end(), std::back_inserter(objects),
               [](const Object& object) { return object.triangle_count > 0; });
  return objects;
}

std::vector<Material> materials_of(const Mesh& mesh) {
  std::array<bool, 256> seen{};
  for (const Material material : mesh.materials) seen[static_cast<std::uint8_t>(material)] = true;
  std::vector<Material> materials;
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (seen[i]) materials.push_back(static_cast<Material>(i));
  return materials;
}

void append_metres(fmt::memory_buffer& out, double metres) {
  const std::size_t begin = out.size();
  fmt::format_to(std::back_inserter(out), "{:.6f}", std::abs(metres) < 5e-7 ? 0.0 : metres);
  std::size_t end = out.size();
  while (out.data()[end - 1] == '0') --end;
  if (out.data()[end - 1] == '.') --end;
  out.resize(std::max(begin + 1, end));
}

void write_collada(OutputFile& file, const Mesh& mesh, const std::vector<ColladaNode>& nodes,
                   const std::string& title, const std::string& comment, bool marked,
                   const Eigen::Vector3d& origin) {
  ColladaWriter(file, mesh, origin).write(nodes, title, comment, marked);
}

void write_glb(OutputFile& file, const City& city) {
  GltfBuilder(city).write(file);
}

}  // namespace canyon::city
