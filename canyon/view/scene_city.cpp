#include "canyon/view/scene_city.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <limits>
#include <system_error>

#include "canyon/base/output_file.hpp"
#include "canyon/city/gltf_writer.hpp"
#include "canyon/city/mesh_parts.hpp"
#include "canyon/output/view_chunk.hpp"

namespace canyon::view {
namespace {

/// A part of a map's feature is named by it with "#2" behind, a city's building by itself.
std::string feature_of(const std::string& object) {
  const std::size_t part = object.rfind('#');
  return part == std::string::npos || part == 0 ? object : object.substr(0, part);
}

SceneObject describe(const city::Mesh& mesh, const city::Object& object,
                     const std::map<std::string, std::string>& height_sources) {
  SceneObject result;
  result.id = object.name;
  result.surface = object.surface;
  result.low_m = std::numeric_limits<double>::max();
  result.high_m = std::numeric_limits<double>::lowest();
  std::array<double, 256> area{};
  for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    for (const std::uint32_t v : mesh.triangles[t]) {
      result.low_m = std::min(result.low_m, mesh.vertices[v].z());
      result.high_m = std::max(result.high_m, mesh.vertices[v].z());
    }
    area[static_cast<std::uint8_t>(mesh.materials[t])] +=
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
  }
  result.material = static_cast<city::Material>(std::max_element(area.begin(), area.end()) - area.begin());
  for (const std::string& name : {object.name, feature_of(object.name)}) {
    const auto found = height_sources.find(name);
    if (found == height_sources.end()) continue;
    result.height_source = found->second;
    break;
  }
  return result;
}

/// The glTF's bytes: its writer knows files only.
std::string glb_of(const city::City& city, const std::filesystem::path& folder) {
  OutputFile file(folder / "city.glb");
  city::write_glb(file, city);
  file.commit();
  std::ifstream in(file.path(), std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  std::error_code error;
  std::filesystem::remove(file.path(), error);
  return bytes;
}

}  // namespace

SceneCity write_city(const city::City& city, const std::map<std::string, std::string>& height_sources,
                     const std::filesystem::path& folder) {
  SceneCity scene{city.name, city.frame.origin(), city.notes, {}, city.mesh.triangles.size()};
  for (const city::Object& object : city::objects_with_triangles(city.mesh)) {
    scene.objects.push_back(describe(city.mesh, object, height_sources));
  }
  write_file(folder / kCityChunk, output::gzip(glb_of(city, folder)));
  return scene;
}

}  // namespace canyon::view
