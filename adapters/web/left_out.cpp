// No header declares it: it replaces sources left out by CMakeLists.txt, readers that need GDAL,
// GEOS, libosmium, libarchive or an XML reader.
#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/unpack.hpp"
#include "canyon/city/buildings/sources/osm_reader.hpp"
#include "canyon/city/gazebo_import.hpp"
#include "canyon/city/meshes/mesh_scene.hpp"
#include "canyon/city/meshes/polygon.hpp"
#include "canyon/city/tiles/read_tiles.hpp"
#include "canyon/simulation/read_map.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& path, const char* what) {
  throw InputError(
      path, 0, std::string(what) + " cannot be read in a page",
      "build a city from it with the installed program (canyon city build), and drop the .canyon file");
}

}  // namespace

std::string unpack(const std::filesystem::path& path, std::string_view /*packed*/) {
  throw InputError(path, 0, "an archive cannot be read in a page", "unpack it first");
}
std::vector<std::string> zip_names(const std::filesystem::path& /*path*/) {
  return {};
}

namespace buildings {
StreetMap read_streets(const std::vector<std::filesystem::path>& paths) {
  refuse(paths.front(), "a map of OpenStreetMap");
}
}  // namespace buildings

namespace meshes {
MeshScene read_collada(const std::filesystem::path& path, bool /*object_names*/) {
  refuse(path, "Collada");
}
/// A fan, valid for convex faces.
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
      throw InputError("a face of the mesh is concave; a page cannot triangulate it", "triangulate the mesh");
    triangles.push_back({corners[0], corners[i], corners[i + 1]});
  }
  return true;
}
}  // namespace meshes

namespace simulation {
buildings::BuiltCity read_map(const MapCity& config, const CityConfig& /*city*/,
                              const std::function<void(std::size_t, std::size_t)>& /*progress*/) {
  refuse(config.files.front(), "a map");
}
double sea_level_m(buildings::GeoidModel /*model*/, const geodesy::Geodetic& /*place*/) {
  throw InputError("a page has no geoid grids", "write city.geoid_undulation_m");
}
}  // namespace simulation

namespace tiles {
TilesCity read_tiles(const TileOptions& options, const std::optional<geodesy::Geodetic>& /*origin*/,
                     const std::function<void(std::size_t, std::size_t)>& /*progress*/) {
  refuse(options.url, "a tileset");
}
}  // namespace tiles

namespace city {
City read_gazebo_world(const std::filesystem::path& path) {
  refuse(path, "a world of Gazebo");
}
}  // namespace city

}  // namespace canyon
