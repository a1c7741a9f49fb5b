#include "canyon/city/mesh_export.hpp"
#include "canyon/city/mesh_parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <string>
#include <system_error>
#include <unordered_map>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/city/mesh_marks.hpp"

namespace canyon::city {
namespace {

std::string origin_line(const City& city) {
  const geodesy::Geodetic& origin = city.frame.origin();
  return fmt::format("east-north-up about latitude {:.9f} deg, longitude {:.9f} deg, height {:.4f} m",
                     geodesy::degrees(origin.latitude_rad), geodesy::degrees(origin.longitude_rad),
                     origin.height_m);
}

/// The text as a comment of one line.
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
      for (const auto& [a, b, c] : group.triangles) {
        fmt::format_to(to(), "f {} {} {}\n", first + a, first + b, first + c);
      }
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

}  // namespace

void write_mesh(const std::filesystem::path& path, const City& city) {
  const std::string extension = lower_case(path.extension().string());
  if (extension != ".glb" && extension != ".obj" && extension != ".dae") {
    throw InputError(path, 0, fmt::format("unknown mesh format '{}'", extension), "use .glb, .obj or .dae");
  }
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
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i]) materials.push_back(static_cast<Material>(i));
  }
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

}  // namespace canyon::city
