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

// `city:` of a scenario. A new kind of city is an alternative of CitySource and three functions:
// source_of_file() recognises its files, visit(CityConfig) lists its fields, read_city() reads it.

namespace canyon::simulation {

/// No buildings: open sky about the origin.
struct OpenField {};

/// Canyon's format (.canyon), a Gazebo world (.world, .sdf), or a Gazebo model's folder; with its own origin.
struct CityFile {
  std::filesystem::path path;
};

/// A mesh file: .dae, .obj, .stl, .gltf, .glb, .ply.
struct MeshCity {
  std::filesystem::path path;
  city::MeshImportOptions import;  ///< CityConfig::origin replaces its origin
};

/// Map files, and options for the buildings made from them.
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

/// Uncertainty of a city's position. Each run samples its offset and heading by its seed (load_city()).
struct Georeference {
  double sigma_m = 0;            ///< standard deviation, eastwards and northwards each [m]; [0, 1000]
  double heading_sigma_rad = 0;  ///< standard deviation [rad], about the middle of the bounds; [0, pi/4]
};

struct CityConfig {
  CitySource source;
  /// Position of the zero of the city's frame. Empty: a CityFile's own, a SyntheticCity's default, the middle
  /// of a map's or tileset's contents; a scenario's reader requires it for a mesh and an open field.
  std::optional<geodesy::Geodetic> origin;
  /// Height of mean sea level, for any city; by default from the city's file.
  buildings::TerrainOptions sea_level;
  city::FacadeOptions facades;
  double roofs_m = 0;  ///< city::raise_roofs() by this mean [m], [0, 100]
  Georeference georeference;

  /// The source if it is of this kind, else null.
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
void visit(options::Visitor& v, CityConfig& o);
void visit(options::Visitor& v, Georeference& o);

/// The kind of source of a file, by its name; for city models (CityGML, CityJSON, archives and folders of
/// them) and tilesets also by its content. Web addresses are 3D Tiles. Empty for other names and contents.
[[nodiscard]] std::optional<CitySource> source_of_file(const std::filesystem::path& path);
/// Whether source_of_file() is of this kind.
template <typename Source>
[[nodiscard]] bool is_file_of(const std::filesystem::path& path) {
  const std::optional<CitySource> source = source_of_file(path);
  return source && std::holds_alternative<Source>(*source);
}
/// The endings that source_of_file() recognises, for messages.
[[nodiscard]] const char* city_file_endings();

/// The configuration that loads a city file of any kind, or a Gazebo model's folder. Throws InputError if
/// source_of_file() does not recognise the file, and if `origin` is given for a file that has its own. @param
/// origin position of a mesh's zero, or the origin to use for a map or tileset
[[nodiscard]] CityConfig city_config(const std::filesystem::path& file,
                                     const std::optional<geodesy::Geodetic>& origin = {});

}  // namespace canyon::simulation
