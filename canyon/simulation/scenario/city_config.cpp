#include "canyon/simulation/scenario/city_config.hpp"

#include <string>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/buildings/sources/model_kind.hpp"

namespace canyon::simulation {
namespace {

using buildings::has_ending;

tiles::TileOptions tileset(const std::filesystem::path& path) {
  tiles::TileOptions options;
  if (tiles::is_web_address(path.string())) {
    options.url = path.string();
  } else {
    options.file = path;
  }
  return options;
}

MapCity map_of(const std::filesystem::path& path) {
  MapCity map;
  map.files = {path};
  return map;
}

}  // namespace

std::optional<CitySource> source_of_file(const std::filesystem::path& path) {
  if (tiles::is_tileset(path)) return tileset(path);
  if (has_ending(path, {".osm", ".osm.gz", ".osm.bz2", ".pbf", ".json", ".json.gz", ".jsonl", ".jsonl.gz",
                        ".gml", ".citygml"}))
    return map_of(path);
  if (has_ending(path, {".dae", ".obj", ".stl", ".gltf", ".glb", ".ply"})) return MeshCity{path, {}};
  std::error_code ignored;
  if (has_ending(path, {".canyon", ".world", ".sdf"}) || std::filesystem::exists(path / "model.sdf", ignored))
    return CityFile{path};
  if (buildings::model_kind(path) != buildings::ModelKind::None) return map_of(path);
  return std::nullopt;
}

const char* city_file_endings() {
  return "known are .osm, .osm.gz, .osm.bz2, .osm.pbf, .json (CityJSON, Overpass, tileset.json of 3D Tiles), "
         ".3tz, .jsonl, .gml, .xml, .gz, .zip and folders (CityGML, CityJSON), .canyon, .world, .sdf, .dae, "
         ".obj, "
         ".stl, .gltf, .glb, .ply";
}

CityConfig city_config(const std::filesystem::path& file, const std::optional<geodesy::Geodetic>& origin) {
  std::optional<CitySource> source = source_of_file(file);
  if (!source) {
    throw explained(InputError(file, 0, "its ending is not one of a city", city_file_endings()), file,
                    "a city");
  }
  if (origin && std::holds_alternative<CityFile>(*source))
    throw InputError(file, 0, "has its own origin", "remove the other one");
  CityConfig config;
  config.source = *std::move(source);
  config.origin = origin;
  return config;
}

}  // namespace canyon::simulation
