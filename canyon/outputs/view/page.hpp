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

/// The viewer as one HTML page, built from viewer/ (`./run view`): the environment variable CANYON_VIEWER,
/// else viewer.html of the installed share/canyon, else that of the source tree. Throws InputError, with the
/// command that builds it, if there is no page.
[[nodiscard]] std::filesystem::path find_page();

/// Whether it is the name of a file that may be requested after "/view/": lower-case letters, digits, '-',
/// and dots between them (viewer/schema.json: "file"). Paths to other folders are not.
[[nodiscard]] bool is_served_name(std::string_view name);

/// The files of the view in a folder, the city's first. Throws InputError if it has no view, if a file of the
/// view is missing, truncated or a link, and for names that a Server does not serve.
[[nodiscard]] std::vector<std::string> view_files(const std::filesystem::path& folder);

/// Fills a page in with the view of a folder: `target` opens from disk, without server and network. Returns
/// its size [bytes]. Throws InputError as view_files() does, or if the page is not Canyon's.
std::size_t export_page(const std::filesystem::path& page, const std::filesystem::path& folder,
                        const std::filesystem::path& target);

/// The bytes of a file. Throws InputError if it cannot be read.
[[nodiscard]] std::string read_bytes(const std::filesystem::path& path);

/// A building, terrain or tree as named in the viewer; in the order of the glTF's nodes.
struct SceneObject {
  std::string id;
  city::Surface surface = city::Surface::Building;
  city::Material material = city::Material::Unknown;  ///< of the largest part of its area
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

/// Writes the city's mesh to `folder` (glTF binary, gzip) and returns its entry in the header.
/// @param height_sources source of heights, by objects' names; may be empty
/// Throws InputError if it cannot be written to the folder.
[[nodiscard]] SceneCity write_city(const city::City& city,
                                   const std::map<std::string, std::string>& height_sources,
                                   const std::filesystem::path& folder);

}  // namespace canyon::view
