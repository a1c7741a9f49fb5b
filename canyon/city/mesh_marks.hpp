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

/// How a mesh file lies on the Earth: v_enu = Rz(heading) * scale * v_file + offset, about `origin`.
struct MeshImportOptions {
  geodesy::Geodetic origin;
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();  ///< east, north, up
  double heading_rad = 0;                              ///< turns the mesh counter-clockwise seen from above
  double scale = 1;                                    ///< on top of the unit that the file declares; > 0
  std::optional<char>
      up_axis;  ///< 'Y' or 'Z' where the file's own word is wrong or missing (OBJ, STL, PLY: Z)
  /// Words that mark terrain in the name of a node or of one above it, upper or lower case: "Terrain_02",
  /// "cityGround" and "dem.001" do, "Underground" and "academy" do not.
  std::vector<std::string> terrain_names{"terrain", "ground", "dem"};
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
/// Visits its fields.
void visit(options::Visitor& v, MeshImportOptions& o);

// How Canyon's own mesh files say what a mesh format has no word for, so that read_mesh_city() gives back the
// same objects, surfaces and materials. Another program that writes the file anew drops kMeshMark, and the
// file is read like any other; its surfaces' words are still understood.
/// Stands near the beginning of every mesh file that Canyon writes: each node is one object as it stands.
inline constexpr std::string_view kMeshMark = "Canyon city, one object in each node";

/// Writers of mesh files hand text on in pieces of so many bytes.
inline constexpr std::size_t kFlushBytes = std::size_t{1} << 20;

/// Whether kMeshMark stands in the first 64 KiB. False for a file that cannot be read.
[[nodiscard]] bool has_mesh_mark(const std::filesystem::path& path);

/// The characters that a format's names may have.
enum class NameCharacters : std::uint8_t {
  Utf8,    ///< any text (glTF)
  Word,    ///< no blanks, unique (OBJ ends names at a blank and merges those that are equal)
  XmlName  ///< an XML NCName's ASCII characters, letters beyond ASCII (COLLADA's xs:NCName)
};

/// One node name for each object. The surface goes before the name, "foliage:Oak 7", where the name alone
/// would be read as another: names with a word of MeshImportOptions::terrain_names are terrain, all others
/// buildings. A byte that the format cannot hold becomes "_x0020_" (its value in hexadecimal); the second,
/// third ... object of a name gets "_xFFFE_2", "_xFFFE_3" at its end where the format wants names unique.
/// Names are cut after 120 bytes.
[[nodiscard]] std::vector<std::string> node_names(const std::vector<Object>& objects,
                                                  NameCharacters characters);

struct NodeName {
  std::string name;
  Surface surface = Surface::Building;
};
/// Reads a name that node_names() wrote.
[[nodiscard]] NodeName read_node_name(std::string_view node_name);

/// The surface that stands before a name, like "foliage:Oak 7", and what follows; a name without one is
/// terrain by its words or a building. `marked` says whether a surface stood there.
[[nodiscard]] NodeName split_surface(std::string_view name, bool* marked = nullptr);

/// "glass", "unknown" ...: lower case, one for each material.
[[nodiscard]] std::string_view material_name(Material material);
/// The material with this material_name(); Unknown for any other name.
[[nodiscard]] Material material_by_name(std::string_view name);
/// Red, green, blue in [0, 1] for pictures of the city.
[[nodiscard]] std::array<double, 3> material_colour(Material material);

/// Whether `word` stands in `text` as a word of its own or as one of a CamelCase name, in upper or lower
/// case: "terrain" in "City_TERRAIN.01" and "flatTerrain2", not in "subterrain". False for an empty word.
[[nodiscard]] bool has_word(std::string_view text, std::string_view word);

/// The material by words that artists and exporters use ("red_brick.003"); roof tiles count as brick, stucco
/// as plaster. Unknown where no word fits.
[[nodiscard]] Material material_from_name(std::string_view name);

}  // namespace canyon::city
