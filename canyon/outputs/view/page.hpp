#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/city/city.hpp"

namespace canyon::view {

/// viewer.html of the source tree that this program was built from; cmake/viewer.cmake defines it.
extern const char* const built_page;

/// The viewer as one HTML page, built from viewer/ (`./run view`): CANYON_VIEWER where the environment names
/// one, else viewer.html of the installed share/canyon, else that of the source tree. Throws InputError, with
/// the command that builds it, where there is none.
[[nodiscard]] std::filesystem::path find_page();

/// The name of a file that may be asked for, behind "/view/": small letters, digits, '-', and dots between
/// (viewer/schema.json: "file"). Whatever leads elsewhere is none.
[[nodiscard]] bool is_served_name(std::string_view name);

/// The files of the view in a folder, the city's first. Throws InputError where it has no view, where a file
/// of it is missing, cut off or a link, and for names that a Server does not give.
[[nodiscard]] std::vector<std::string> view_files(const std::filesystem::path& folder);

/// Fills a page in with the view of a folder: `target` opens from disk, without a server and without a
/// network. Returns its size in bytes. Throws InputError where view_files() does, or where the page is
/// none of Canyon's.
std::size_t export_page(const std::filesystem::path& page, const std::filesystem::path& folder,
                        const std::filesystem::path& target);

/// The bytes of a file. Throws InputError where it cannot be read.
[[nodiscard]] std::string read_bytes(const std::filesystem::path& path);

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
