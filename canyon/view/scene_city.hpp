#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "canyon/city/city.hpp"

namespace canyon::view {

/// A building, terrain, tree as the viewer names it; in the order of the glTF's nodes.
struct SceneObject {
  std::string id;
  city::Surface surface = city::Surface::Building;
  city::Material material = city::Material::Unknown;  ///< of the largest share of its area
  double low_m = 0, high_m = 0;                       ///< z of its lowest and highest point, city's frame
  std::string height_source;                          ///< "height", "levels", ...; empty: not known
};

/// A city in the header. Its mesh is a chunk of its own.
struct SceneCity {
  std::string name;
  geodesy::Geodetic origin;
  std::vector<std::string> notes;
  std::vector<SceneObject> objects;
  std::size_t triangles = 0;
};

/// File of the city's mesh in a view's folder.
inline constexpr const char* kCityChunk = "city.glb.gz";

/// Writes the city's mesh to `folder` (glTF binary, gzip) and returns what the header says of it.
/// @param height_sources where heights came from, by objects' names; may be empty
/// Throws InputError where the folder does not take it.
[[nodiscard]] SceneCity write_city(const city::City& city,
                                   const std::map<std::string, std::string>& height_sources,
                                   const std::filesystem::path& folder);

}  // namespace canyon::view
