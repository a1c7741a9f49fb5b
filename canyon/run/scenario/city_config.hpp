#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <variant>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/city/buildings/sources/map_options.hpp"
#include "canyon/city/facades.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/city/tiles/tile_options.hpp"

// `city:` of a scenario. A new kind of city is one more alternative of CitySource. Three functions handle
// each kind: source_of_file() recognises its files, visit(CityConfig) lists its fields, and read_city() reads
// it.

namespace canyon::simulation {

/// No buildings: open sky about the origin.
struct OpenField {};

/// Canyon's own file (.canyon), a Gazebo world (.world, .sdf), or a Gazebo model's folder. It has its own
/// origin.
struct CityFile {
  std::filesystem::path path;
};

/// A mesh file: .dae, .obj, .stl, .gltf, .glb, .ply.
struct MeshCity {
  std::filesystem::path path;
  city::MeshImportOptions import;  ///< CityConfig::origin replaces its origin
};

/// Map files, and how buildings are made of them.
struct MapCity {
  std::vector<std::filesystem::path> files;  ///< OpenStreetMap and city models (CityGML, CityJSON)
  buildings::ModelOptions model;             ///< of city models
  std::vector<std::filesystem::path> terrain;
  std::optional<std::array<double, 4>> bbox_deg;  ///< west, south, east, north
  /// CityConfig::origin replaces its origin.
  buildings::BuildOptions build;
};

using CitySource = std::variant<OpenField, CityFile, MeshCity, MapCity, tiles::TileOptions,  // 3D Tiles
                                city::SyntheticCityOptions>;

/// How well the place of a city is known. A run draws its own offset and heading by its seed (load_city()).
struct Georeference {
  double sigma_m = 0;            ///< standard deviation, eastwards and northwards each [m]; [0, 1000]
  double heading_sigma_rad = 0;  ///< standard deviation [rad], about the middle of the bounds; [0, pi/4]
};

struct CityConfig {
  CitySource source;
  /// Place of the zero of the city's frame. Empty: a CityFile's own, a SyntheticCity's default, the middle of
  /// what a map or a tileset holds; a scenario's reader requires it of a mesh and an open field.
  std::optional<geodesy::Geodetic> origin;
  /// Where mean sea level is, of any city; by default as the city's file says.
  buildings::TerrainOptions sea_level;
  city::FacadeOptions facades;
  double roofs_m = 0;  ///< city::raise_roofs() by this mean [m], [0, 100]
  Georeference georeference;

  /// The source where it is of this kind, else null.
  template <typename Source>
  [[nodiscard]] const Source* as() const {
    return std::get_if<Source>(&source);
  }
  template <typename Source>
  [[nodiscard]] Source* as() {
    return std::get_if<Source>(&source);
  }
  template <typename Source>
  [[nodiscard]] bool is() const {
    return std::holds_alternative<Source>(source);
  }
};
/// Its fields.
void visit(options::Visitor& v, CityConfig& o);
/// Its fields.
void visit(options::Visitor& v, Georeference& o);

/// The source that a file is, told by its name; city models (CityGML, CityJSON, archives and folders of them)
/// and tilesets also by their content. Web addresses are 3D Tiles. Empty for a name with another ending and
/// other content.
[[nodiscard]] std::optional<CitySource> source_of_file(const std::filesystem::path& path);
/// Whether source_of_file() is of this kind.
template <typename Source>
[[nodiscard]] bool is_file_of(const std::filesystem::path& path) {
  const std::optional<CitySource> source = source_of_file(path);
  return source && std::holds_alternative<Source>(*source);
}
/// The endings that source_of_file() knows, for messages.
[[nodiscard]] const char* city_file_endings();

/// The configuration that loads a city file of any kind, or a Gazebo model's folder. Throws InputError where
/// source_of_file() does not know the file, and for an origin beside a file that says its own.
/// @param origin where a mesh's zero lies, or a map's or tileset's shall
[[nodiscard]] CityConfig city_config(const std::filesystem::path& file,
                                     const std::optional<geodesy::Geodetic>& origin = {});

}  // namespace canyon::simulation
