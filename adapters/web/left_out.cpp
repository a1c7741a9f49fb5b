// No header declares it: it stands in for sources that CMakeLists.txt leaves out.
// What a page does without, in the place of the sources that CMakeLists.txt leaves out: readers that need
// GDAL, GEOS, libosmium, libarchive or an XML reader.
#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/unpack.hpp"
#include "canyon/city/buildings/sources/osm_reader.hpp"
#include "canyon/city/city_file.hpp"
#include "canyon/city/mesh_file.hpp"
#include "canyon/city/meshes/mesh_scene.hpp"
#include "canyon/city/meshes/polygon.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/run/read_city.hpp"
#include "canyon/run/scenario/scenario.hpp"

namespace canyon {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& path, const char* what) {
  throw InputError(
      path, 0, std::string(what) + " is not read in a page",
      "make a city of it with the installed program (canyon city build), and drop the .canyon file");
}

}  // namespace

std::string unpack(const std::filesystem::path& path, std::string_view /*packed*/) {
  throw InputError(path, 0, "an archive is not read in a page", "unpack it first");
}
std::vector<std::string> zip_names(const std::filesystem::path& /*path*/) {
  return {};
}

namespace buildings {
MapData read_osm(const std::vector<std::filesystem::path>& paths, const OsmReadOptions& /*options*/) {
  refuse(paths.front(), "a map of OpenStreetMap");
}
StreetMap read_streets(const std::vector<std::filesystem::path>& paths) {
  refuse(paths.front(), "a map of OpenStreetMap");
}
}  // namespace buildings

namespace meshes {
MeshScene read_collada(const std::filesystem::path& path, bool /*own_names*/) {
  refuse(path, "Collada");
}
/// A fan, which covers faces without notches.
bool add_face(const std::vector<Eigen::Vector3d>& vertices, const std::vector<std::uint32_t>& corners,
              TriangleList& triangles) {
  const auto normal = [&](std::size_t i) -> Eigen::Vector3d {
    const Eigen::Vector3d& at = vertices[corners[0]];
    return (vertices[corners[i]] - at).cross(vertices[corners[i + 1]] - at);
  };
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) mean += normal(i);
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    if (normal(i).dot(mean) < 0)
      throw InputError("a face of the mesh has a notch, which a page does not divide",
                       "triangulate the mesh");
    triangles.push_back({corners[0], corners[i], corners[i + 1]});
  }
  return true;
}
}  // namespace meshes

namespace simulation {
buildings::BuiltCity read_city(const CityConfig& config,
                               const std::function<void(std::size_t, std::size_t)>& /*progress*/) {
  buildings::BuiltCity out;
  const geodesy::Geodetic origin = config.origin.value_or(geodesy::Geodetic{});
  if (const auto* mesh = config.as<MeshCity>()) {
    city::MeshImportOptions import = mesh->import;
    import.origin = origin;
    out.city = city::read_mesh_city(mesh->path, import);
  } else if (const auto* synthetic = config.as<city::SyntheticCityOptions>()) {
    city::SyntheticCityOptions placed = *synthetic;
    if (config.origin) placed.origin = origin;
    out.city = city::synthetic_city(placed);
  } else if (const auto* file = config.as<CityFile>()) {
    if (lower_case(file->path.extension().string()) != ".canyon") refuse(file->path, "a world of Gazebo");
    out.city = city::read_city_file(file->path);
  } else if (config.is<OpenField>()) {
    out.city.name = "open field";
    out.city.frame = geodesy::LocalFrame(origin);
  } else {
    refuse("city", "a map");
  }
  if (config.sea_level.geoid_undulation_m) out.city.geoid_undulation_m = *config.sea_level.geoid_undulation_m;
  return out;
}
}  // namespace simulation

}  // namespace canyon
