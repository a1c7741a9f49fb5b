#include "canyon/simulation/scenario/city_config.hpp"

#include <fmt/format.h>

#include <string_view>
#include <utility>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/buildings/sources/model_kind.hpp"
#include "canyon/simulation/scenario/scenario_fields.hpp"

namespace canyon::simulation {

namespace {

using buildings::has_ending;

tiles::TileOptions tileset(const std::filesystem::path& path) {
  tiles::TileOptions options;
  if (tiles::is_web_address(path.string()))
    options.url = path.string();
  else
    options.file = path;
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
    throw InputError(file, 0, "has its own origin", "remove the given one");
  CityConfig config;
  config.source = *std::move(source);
  config.origin = origin;
  return config;
}

namespace {

using geodesy::Geodetic;
using options::Visitor;

constexpr const char* kCityHint = "give one of osm, file, mesh, tiles, synthetic: {} or open: true";

void visit_origin(Visitor& v, std::optional<Geodetic>& origin) {
  std::optional<double> latitude, longitude;
  double height_m = 0;
  if (origin) {
    latitude = options::exact_degrees(origin->latitude_rad);
    longitude = options::exact_degrees(origin->longitude_rad);
    height_m = origin->height_m;
  }
  v.require("latitude_deg");
  v.require("longitude_deg");
  v.number({"latitude_deg", "deg",
            "origin of the mesh, the map or the tileset (default for these two: their middle): geodetic "
            "latitude (WGS 84)"},
           latitude, kLatitude_deg);
  v.number({"longitude_deg", "deg", "longitude, east positive"}, longitude, kLongitude_deg);
  v.number({"height_m", "m", "ellipsoidal height"}, height_m, kHeight_m);
  if (v.reads()) origin = Geodetic::from_degrees(*latitude, *longitude, height_m);
}

void visit_fields(Visitor& v, MapCity& map) {
  v.files(
      {"terrain", "",
       "height rasters under a map, one or a list: GeoTIFF, SRTM HGT, DTED, Arc/Info grids, ERDAS Imagine, "
       "BIL, USGS DEM, XYZ"},
      map.terrain);
  std::vector<double> box;
  if (map.bbox_deg) box.assign(map.bbox_deg->begin(), map.bbox_deg->end());
  v.numbers(
      {"bbox", "deg", "[west, south, east, north]: only map objects that touch this box", "the whole map"},
      box, kLongitude_deg);
  if (v.reads() && !box.empty()) {
    // West above east: across the antimeridian.
    const bool wide = box.size() == 4 && !(box[0] < box[2]) && !(box[0] > box[2] + 180);
    if (box.size() != 4 || wide || !(box[1] < box[3]) || box[1] < -90 || box[3] > 90) {
      throw v.fault("bbox", "is not a box",
                    "give [west, south, east, north] in degrees, west below east and south below north");
    }
    map.bbox_deg = {box[0], box[1], box[2], box[3]};
  }
  visit(v, map.model);
  visit(v, map.build);
}

void visit_fields(Visitor& v, MeshCity& mesh) {
  visit(v, mesh.import);
  v.validate(mesh.import);
}

void visit_fields(Visitor& v, tiles::TileOptions& tileset) {
  v.part("tiles", tileset);
  if (v.reads() && !tileset.file && tileset.url.empty())
    throw v.fault("tiles", "does not name a tileset", "give file: tileset.json, or url: its http(s) address");
}

void visit_fields(Visitor& v, city::SyntheticCityOptions& synthetic) {
  v.part("synthetic", synthetic);
}

/// Visits the fields of one kind of source, if the city is of this kind or all kinds are described.
template <typename Source>
void visit_source(Visitor& v, CityConfig& city) {
  Source none;
  if (v.wants(city.is<Source>())) visit_fields(v, city.is<Source>() ? *city.as<Source>() : none);
}

CitySource source_of(Visitor& v, const std::filesystem::path& path, std::string_view key) {
  if (std::optional<CitySource> source = source_of_file(path)) return *std::move(source);
  if (key == "mesh") return MeshCity{path, {}};
  throw v.fault(key, fmt::format("'{}' is not a known city file", path.string()), city_file_endings());
}

/// The keys that select the kind of source.
void visit_kind(Visitor& v, CityConfig& city) {
  std::vector<std::filesystem::path> osm;
  std::optional<std::filesystem::path> file, mesh;
  if (const auto* map = city.as<MapCity>()) osm = map->files;
  if (const auto* own = city.as<CityFile>()) file = own->path;
  if (const auto* model = city.as<MeshCity>()) mesh = model->path;
  v.one_of({"osm", "file", "mesh", "tiles", "synthetic", "open"}, kCityHint);
  v.files(
      {"osm", "",
       "map files, one or a list: .osm, .osm.gz, .osm.bz2, .osm.pbf, Overpass .json; CityGML and CityJSON, "
       "files, zip archives and folders (DIR/) of tiles (one of osm, file, mesh, tiles, synthetic, open)"},
      osm);
  v.file({"file", "",
          "city file: .canyon, Gazebo's .world or .sdf (these have their own origin), a map as for osm, a "
          "mesh, or tileset.json of 3D Tiles"},
         file);
  v.file({"mesh", "", "mesh file: DAE, OBJ, STL, glTF, PLY"}, mesh);
  if (!v.reads()) return;
  if (!osm.empty()) city.source.emplace<MapCity>().files = osm;
  if (file) city.source = source_of(v, *file, "file");
  if (mesh) city.source = source_of(v, *mesh, "mesh");
  if (v.has("synthetic")) city.source.emplace<city::SyntheticCityOptions>();
  if (v.has("tiles")) city.source.emplace<tiles::TileOptions>();
}

void visit_open(Visitor& v, const CityConfig& city) {
  if (!v.wants(v.reads() ? v.has("open") : city.is<OpenField>())) return;
  bool open = !v.reads() && !v.describes();
  v.boolean({"open", "", "true: no buildings, open sky"}, open);
  if (v.reads() && !open) throw v.fault({}, "city has no content", kCityHint);
}

}  // namespace

void visit(Visitor& v, Georeference& o) {
  v.number({"sigma_m", "m",
            "standard deviation of the city's position in east and in north: one sample per run moves the "
            "whole city"},
           o.sigma_m, {0, 1000});
  v.angle({"heading_sigma_deg", "deg",
           "standard deviation of the city's heading about the middle of its bounds: one sample per run"},
          o.heading_sigma_rad, {0, 45});
}

void visit(Visitor& v, CityConfig& city) {
  visit_kind(v, city);
  visit_source<MapCity>(v, city);
  if (city.is<CityFile>() && v.has("origin"))
    throw v.fault("origin", "the file has its own origin", "remove it");
  if (v.wants(v.reads() ? !city.is<CityFile>() : city.origin.has_value()))
    v.section("origin", [&] { visit_origin(v, city.origin); });
  visit(v, city.sea_level);
  v.validate(city.sea_level);
  visit_open(v, city);
  if (v.reads() && !city.origin) {
    if (const auto* made_up = city.as<city::SyntheticCityOptions>()) city.origin = made_up->origin;
    if (city.is<MeshCity>() || city.is<OpenField>())
      throw v.fault({}, "city has no origin", "add origin: {latitude_deg: ..., longitude_deg: ...}");
  }
  visit_source<MeshCity>(v, city);
  visit_source<tiles::TileOptions>(v, city);
  visit_source<city::SyntheticCityOptions>(v, city);
  v.part("facades", city.facades);
  v.number({"roofs_m", "m",
            "mean height by which buildings are higher than in the map, sampled for each by the seed: for "
            "maps of outlines and antennas near the ground"},
           city.roofs_m, {0, 100});
  v.part("georeference", city.georeference);
}

}  // namespace canyon::simulation
