#include "canyon/city/mesh_parts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <unordered_map>

namespace canyon::city {

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
