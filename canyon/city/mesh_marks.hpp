#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/city.hpp"

namespace canyon::city {

/// Placement of a mesh file on the Earth: v_enu = Rz(heading) * scale * v_file + offset, about `origin`.
struct MeshImportOptions {
  geodesy::Geodetic origin;
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();  ///< east, north, up
  double heading_rad = 0;                              ///< rotates the mesh counter-clockwise seen from above
  double scale = 1;                                    ///< in addition to the unit declared in the file; > 0
  std::optional<char> up_axis;  ///< 'Y' or 'Z' if the file's own is wrong or missing (OBJ, STL, PLY: Z)
  /// Words that mark terrain in the name of a node or of a parent, ignoring case: "Terrain_02", "cityGround"
  /// and "dem.001" match, "Underground" and "academy" do not.
  std::vector<std::string> terrain_names{"terrain", "ground", "dem"};
  /// Throws InputError with the field and its bound.
  void validate() const;
};
void visit(options::Visitor& v, MeshImportOptions& o);

// Encoding in Canyon's own mesh files of properties that a mesh format lacks, so that read_mesh_city()
// restores the same objects, surfaces and materials. Another program that rewrites the file drops kMeshMark,
// and the file is read like any other; its surface prefixes are still read.
/// Near the beginning of every mesh file written by Canyon: each node is one object.
inline constexpr std::string_view kMeshMark = "Canyon city, one object in each node";

/// Buffer size of writers of mesh files.
inline constexpr std::size_t kFlushBytes = std::size_t{1} << 20;

/// Whether kMeshMark is in the first 64 KiB. False for a file that cannot be read.
[[nodiscard]] bool has_mesh_mark(const std::filesystem::path& path);

/// The characters that a format's names may have.
enum class NameCharacters : std::uint8_t {
  Utf8,    ///< any text (glTF)
  Word,    ///< no blanks, unique (OBJ ends names at a blank and merges equal ones)
  XmlName  ///< an XML NCName's ASCII characters, letters beyond ASCII (COLLADA's xs:NCName)
};

/// One node name for each object. The surface precedes the name, "foliage:Oak 7", if the name alone would be
/// read as another surface: names with a word of MeshImportOptions::terrain_names are terrain, all others
/// buildings. A byte not allowed in the format becomes "_x0020_" (its hexadecimal value); if the format needs
/// unique names, later objects of a name end with "_xFFFE_2", "_xFFFE_3", ... Names are cut after 120 bytes.
[[nodiscard]] std::vector<std::string> node_names(const std::vector<Object>& objects,
                                                  NameCharacters characters);

struct NodeName {
  std::string name;
  Surface surface = Surface::Building;
};
/// Reads a name written by node_names().
[[nodiscard]] NodeName read_node_name(std::string_view node_name);

/// The surface before a name, like "foliage:Oak 7", and the rest; a name without a surface is terrain by its
/// words or a building. `marked` returns whether there was a surface.
[[nodiscard]] NodeName split_surface(std::string_view name, bool* marked = nullptr);

/// "glass", "unknown" ...: lower case, one for each material.
[[nodiscard]] std::string_view material_name(Material material);
/// The material with this material_name(); Unknown for any other name.
[[nodiscard]] Material material_by_name(std::string_view name);
/// Red, green, blue in [0, 1] for pictures of the city.
[[nodiscard]] std::array<double, 3> material_colour(Material material);

/// Whether `text` contains `word` as a separate word or as a word of a CamelCase name, ignoring case:
/// "terrain" in "City_TERRAIN.01" and "flatTerrain2", not in "subterrain". False for an empty word.
[[nodiscard]] bool has_word(std::string_view text, std::string_view word);

/// The material by words used by artists and exporters ("red_brick.003"); roof tiles count as brick, stucco
/// as plaster. Unknown if no word fits.
[[nodiscard]] Material material_from_name(std::string_view name);

}  // namespace canyon::city
