#include "canyon/run/load_city.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <variant>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/building_draws.hpp"
#include "canyon/city/buildings/sources/city_files.hpp"
#include "canyon/city/buildings/sources/geoid.hpp"
#include "canyon/city/buildings/sources/model_kind.hpp"
#include "canyon/city/buildings/sources/osm_reader.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/city_file.hpp"
#include "canyon/city/gazebo_export.hpp"
#include "canyon/city/gazebo_import.hpp"
#include "canyon/city/mesh_file.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/city/tiles/read_tiles.hpp"
#include "canyon/run/georeference.hpp"
#include "canyon/run/run_plan.hpp"
#include "canyon/run/scenario/scenario.hpp"

namespace canyon::simulation {

namespace {

/// A scenario reads the tiles of a city model, or keeps the objects of a large city, that are this near to
/// its trajectory.
constexpr double kAboutWay_m = 1000;

bool is_city_model(const std::filesystem::path& path) {
  const std::string ending = lower_case(path.extension().string());
  return ending == ".gml" || ending == ".citygml" ||
         buildings::model_kind(path) != buildings::ModelKind::None;
}

/// Adds the features of a city model.
void append(buildings::MapData& map, buildings::MapData model, const std::optional<buildings::LonLatBox>& box,
            bool foliage) {
  if (!map.geoid_undulation_m) map.geoid_undulation_m = model.geoid_undulation_m;
  map.source += (map.source.empty() ? "" : ", ") + model.source;
  map.notes.append(model.notes);
  if (map.bounds.isEmpty()) map.bounds = model.bounds;
  const double longitude = box ? box->middle_longitude() : map.bounds.center().x();
  for (buildings::MapFeature& feature : model.features) {
    const bool green =
        feature.kind == buildings::FeatureKind::Tree || feature.kind == buildings::FeatureKind::Wood;
    if (green && !foliage) {
      ++map.foliage_left_out;
      continue;
    }
    feature.bring_near(longitude);
    map.bounds.extend(feature.bounds());
    map.features.push_back(std::move(feature));
  }
  map.relief = std::move(model.relief);
}

buildings::MapData read_maps(const MapCity& config, const buildings::TerrainOptions& heights) {
  std::optional<buildings::LonLatBox> box;
  if (config.bbox_deg) {
    const auto& [west, south, east, north] = *config.bbox_deg;
    box = buildings::LonLatBox{west, south, east, north};
    box->validate();
  }
  std::vector<std::filesystem::path> osm, models;
  for (const auto& path : config.files) (is_city_model(path) ? models : osm).push_back(path);
  buildings::MapData map;
  if (!osm.empty()) {
    buildings::OsmReadOptions options;
    options.box = box;
    options.foliage = config.build.foliage;
    try {
      map = buildings::read_osm(osm, options);
    } catch (const InputError& fault) {
      for (const std::filesystem::path& path : osm) {
        const InputError known = explained(fault, path, "a map of OpenStreetMap");
        if (known.problem() != fault.problem()) throw InputError(known);
      }
      throw;
    }
  }
  if (!models.empty())
    append(map, buildings::read_city_files(models, {config.model, heights, box}), box, config.build.foliage);
  if (map.features.empty()) {
    throw InputError(
        map.source + ": no building" + (box ? " in the box" : ""),
        box ? "the box is city.bbox, else of tiles 1 km about the trajectory: check places, or give a "
              "box west,south,east,north that holds some"
            : "give a map with buildings");
  }
  return map;
}

using Progress = std::function<void(std::size_t, std::size_t)>;

buildings::BuiltCity read_source(const MapCity& config, const CityConfig& city, const Progress& progress) {
  // The rasters first: a wrong one is found before minutes of reading.
  std::optional<buildings::Terrain> terrain;
  if (!config.terrain.empty()) terrain.emplace(config.terrain, city.sea_level);
  buildings::BuildOptions build = config.build;
  build.origin = city.origin;
  build.validate();
  buildings::MapData map = read_maps(config, city.sea_level);
  if (!map.relief.empty() && terrain) {
    map.notes.say(ReadReport::Level::Remark,
                  map.source + ": its relief is left out, since city.terrain has height rasters");
  } else if (!map.relief.empty()) {
    terrain.emplace(buildings::Terrain::of_relief(map.relief));
    const auto beyond = std::count_if(map.features.begin(), map.features.end(), [&](const auto& feature) {
      return !terrain->height_m(feature.bounds().center());
    });
    const bool elsewhere = static_cast<std::size_t>(beyond) == map.features.size();
    if (elsewhere) terrain.reset();
    if (beyond > 0) {
      map.notes.say(ReadReport::Level::Loss,
                    fmt::format("{}: {} of {} objects stand beyond its relief, {}", map.source, beyond,
                                map.features.size(), elsewhere ? "which is left out" : "where no ground is"));
    }
  }
  map.relief = {};
  return buildings::build_city(map, terrain ? &*terrain : nullptr, build, progress);
}

buildings::BuiltCity read_source(const tiles::TileOptions& tileset, const CityConfig& city,
                                 const Progress& progress) {
  tiles::TilesCity read = tiles::read_tiles(tileset, city.origin, progress);
  buildings::BuiltCity out;
  out.city = std::move(read.city);
  out.placed = read.georeferenced || city.origin;
  return out;
}

buildings::BuiltCity read_source(const MeshCity& mesh, const CityConfig& city, const Progress& /*progress*/) {
  city::MeshImportOptions import = mesh.import;
  import.origin = city.origin.value_or(geodesy::Geodetic{});
  buildings::BuiltCity out;
  out.city = city::read_mesh_city(mesh.path, import);
  out.placed = city.origin.has_value();
  return out;
}

buildings::BuiltCity read_source(const CityFile& file, const CityConfig& /*city*/,
                                 const Progress& /*progress*/) {
  const bool own = lower_case(file.path.extension().string()) == ".canyon";
  buildings::BuiltCity out;
  out.city = own ? city::read_city_file(file.path) : city::read_gazebo_world(file.path);
  return out;
}

buildings::BuiltCity read_source(const city::SyntheticCityOptions& options, const CityConfig& city,
                                 const Progress& /*progress*/) {
  city::SyntheticCityOptions placed = options;
  if (city.origin) placed.origin = *city.origin;
  buildings::BuiltCity out;
  out.city = city::synthetic_city(placed);
  return out;
}

buildings::BuiltCity read_source(const OpenField& /*field*/, const CityConfig& city,
                                 const Progress& /*progress*/) {
  const geodesy::Geodetic origin = city.origin.value_or(geodesy::Geodetic{});
  geodesy::check_geodetic(origin, "city origin");
  buildings::BuiltCity out;
  out.city.name = "open field";
  out.city.frame = geodesy::LocalFrame(origin);
  return out;
}

}  // namespace

buildings::BuiltCity read_city(const CityConfig& config,
                               const std::function<void(std::size_t, std::size_t)>& progress) {
  config.sea_level.validate();
  buildings::BuiltCity loaded =
      std::visit([&](const auto& source) { return read_source(source, config, progress); }, config.source);
  const geodesy::Geodetic& origin = loaded.city.frame.origin();
  if (config.sea_level.geoid_undulation_m) {
    loaded.city.geoid_undulation_m = *config.sea_level.geoid_undulation_m;
  } else if (config.sea_level.geoid != buildings::GeoidModel::ByFile) {
    loaded.city.geoid_undulation_m = buildings::geoid_undulation_m(
        config.sea_level.geoid,
        {geodesy::degrees(origin.longitude_rad), geodesy::degrees(origin.latitude_rad)});
  }
  return loaded;
}

namespace {

/// Degrees of longitude and latitude about points, with a margin.
class PlaceBounds {
 public:
  void add(const geodesy::Geodetic& place) {
    box_.extend(Eigen::Vector2d(geodesy::degrees(place.longitude_rad), geodesy::degrees(place.latitude_rad)));
  }
  [[nodiscard]] std::optional<std::array<double, 4>> widened(double margin_m) const {
    constexpr double kMostDegrees = 2;  // a longer trajectory needs a box
    if (box_.isEmpty() || box_.sizes().maxCoeff() > kMostDegrees) return std::nullopt;
    const double north = margin_m / geodesy::kSemiMajorAxis * geodesy::kDegreesPerRadian;
    const double east = north / std::max(0.01, std::cos(geodesy::radians(box_.center().y())));
    const Eigen::Vector2d low = box_.min() - Eigen::Vector2d(east, north);
    const Eigen::Vector2d high = box_.max() + Eigen::Vector2d(east, north);
    return std::array<double, 4>{low.x(), low.y(), high.x(), high.y()};
  }

 private:
  Eigen::AlignedBox2d box_;
};

/// Folders and archives of a city model.
bool are_tiles(const std::vector<std::filesystem::path>& files) {
  return std::all_of(files.begin(), files.end(), [](const std::filesystem::path& path) {
    std::error_code ignored;
    return std::filesystem::is_directory(path, ignored) || lower_case(path.extension().string()) == ".zip";
  });
}

/// The trajectory and the fixed receivers; empty where not all of the way is known before the city.
PlaceBounds way_of(const Scenario& scenario) {
  PlaceBounds bounds;
  const TrajectoryConfig& trajectory = scenario.trajectory;
  std::set<std::size_t> unknown;
  for (const auto& [index, enu] : trajectory.local_waypoints) unknown.insert(index);
  for (std::size_t i = 0; i < trajectory.waypoints.size(); ++i)
    if (unknown.count(i) == 0) bounds.add(trajectory.waypoints[i]);
  if (trajectory.file) {
    HeightReading heights;
    heights.needed = false;
    for (const RecordedPoint& point : read_path(scenario, heights).points) bounds.add(point.place);
  }
  for (const ReceiverConfig& receiver : scenario.receivers)
    if (receiver.fixed && !receiver.fixed->local_m) bounds.add(receiver.fixed->place);
  return unknown.empty() ? bounds : PlaceBounds();
}

/// A tileset, or a city model of tiles, without a box of its own is read about these places alone.
CityConfig about(CityConfig config, const PlaceBounds& places) {
  if (auto* tileset = config.as<tiles::TileOptions>(); tileset && !tileset->bbox_deg)
    tileset->bbox_deg = places.widened(tileset->margin_m);
  if (auto* map = config.as<MapCity>(); map && !map->bbox_deg && are_tiles(map->files))
    map->bbox_deg = places.widened(kAboutWay_m);
  return config;
}

}  // namespace

CityConfig city_config(const Scenario& scenario) {
  return about(scenario.city, way_of(scenario));
}

CityConfig city_config(const Scenario& scenario, const std::array<double, 4>& bbox_deg) {
  const auto& [west, south, east, north] = bbox_deg;
  PlaceBounds box;
  box.add({geodesy::radians(south), geodesy::radians(west), 0});
  box.add({geodesy::radians(north), geodesy::radians(east), 0});
  return about(scenario.city, box);
}

namespace {

/// Cities of files with more triangles than this are cut to the surroundings of the trajectory.
constexpr std::size_t kLargeCity = 1'000'000;

void keep_about(city::City& city, const std::array<double, 4>& bbox_deg) {
  const auto& [west, south, east, north] = bbox_deg;
  Eigen::AlignedBox2d plan;
  for (const double longitude : {west, east}) {
    for (const double latitude : {south, north}) {
      const auto corner = geodesy::Geodetic::from_degrees(latitude, longitude, city.frame.origin().height_m);
      plan.extend(city.frame.local_from_geodetic(corner).head<2>().eval());
    }
  }
  const std::size_t dropped = city::keep_within(city.mesh, plan);
  city.notes.say(
      ReadReport::Level::Remark,
      fmt::format("{} objects farther than {:g} m from the trajectory are left out", dropped, kAboutWay_m));
}

city::City draw_buildings(city::City city, const CityConfig& config, std::uint64_t seed) {
  const bool keep = config.facades.keeps_named(config.is<MapCity>());
  const std::string drawn = city::dress_facades(city, config.facades, keep, seed);
  const std::string raised = city::raise_roofs(city, config.roofs_m, seed);
  for (const std::string& each : {drawn, raised})
    if (!each.empty()) city.notes.say(ReadReport::Level::Remark, each);
  city.seed = seed;
  return city;
}

}  // namespace

city::City load_city_source(const CityConfig& config) {
  CityConfig source = config;
  if (auto* map = source.as<MapCity>(); map && config.facades.drawn() && config.facades.keeps_named(true))
    map->build.untagged_facade = city::Material::Unknown;
  return std::move(read_city(source).city);
}

city::City load_city(const CityConfig& config, std::uint64_t seed) {
  return draw_buildings(load_city_source(config), config, seed);
}

city::City draw_city(city::City source, const Scenario& scenario) {
  city::City city = draw_buildings(std::move(source), scenario.city, scenario.seed);
  if (const auto shift = draw_city_shift(scenario.city.georeference, scenario.seed)) {
    move_city(city, *shift);
    city.notes.say(ReadReport::Level::Remark, describe(*shift));
  }
  return city;
}

city::City load_city(const Scenario& scenario) {
  const PlaceBounds way = way_of(scenario);
  city::City source = load_city_source(about(scenario.city, way));
  const auto around = way.widened(kAboutWay_m);
  if (scenario.city.is<CityFile>() && around && source.mesh.triangles.size() > kLargeCity)
    keep_about(source, *around);
  const auto* tileset = scenario.city.as<tiles::TileOptions>();
  if (tileset && tiles::holds_key(tileset->url)) {
    source.notes.say(
        ReadReport::Level::Guess,
        "city.tiles.url holds its key as it is, as will copies of the scenario: write $NAME in its place and "
        "set that variable of the environment");
  }
  return draw_city(std::move(source), scenario);
}

}  // namespace canyon::simulation
