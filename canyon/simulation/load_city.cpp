#include "canyon/simulation/load_city.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <variant>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/building_samples.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/city_file.hpp"
#include "canyon/city/gazebo_import.hpp"
#include "canyon/city/mesh_file.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/city/tiles/read_tiles.hpp"
#include "canyon/simulation/georeference.hpp"
#include "canyon/simulation/read_map.hpp"
#include "canyon/simulation/run_plan.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::simulation {

namespace {

/// Distance from the trajectory within which city model tiles are read, or objects of a large city kept.
constexpr double kRouteMargin_m = 1000;

using ReadProgress = std::function<void(std::size_t, std::size_t)>;

buildings::BuiltCity read_source(const MapCity& map, const CityConfig& city, const ReadProgress& progress) {
  return read_map(map, city, progress);
}

buildings::BuiltCity read_source(const tiles::TileOptions& tileset, const CityConfig& city,
                                 const ReadProgress& progress) {
  tiles::TilesCity read = tiles::read_tiles(tileset, city.origin, progress);
  buildings::BuiltCity out;
  out.city = std::move(read.city);
  out.is_georeferenced = read.georeferenced || city.origin;
  return out;
}

buildings::BuiltCity read_source(const MeshCity& mesh, const CityConfig& city,
                                 const ReadProgress& /*progress*/) {
  city::MeshImportOptions import = mesh.import;
  import.origin = city.origin.value_or(geodesy::Geodetic{});
  buildings::BuiltCity out;
  out.city = city::read_mesh_city(mesh.path, import);
  out.is_georeferenced = city.origin.has_value();
  return out;
}

buildings::BuiltCity read_source(const CityFile& file, const CityConfig& /*city*/,
                                 const ReadProgress& /*progress*/) {
  const bool own = lower_case(file.path.extension().string()) == ".canyon";
  buildings::BuiltCity out;
  out.city = own ? city::read_city_file(file.path) : city::read_gazebo_world(file.path);
  return out;
}

buildings::BuiltCity read_source(const city::SyntheticCityOptions& options, const CityConfig& city,
                                 const ReadProgress& /*progress*/) {
  city::SyntheticCityOptions posed = options;
  if (city.origin) posed.origin = *city.origin;
  buildings::BuiltCity out;
  out.city = city::synthetic_city(posed);
  return out;
}

buildings::BuiltCity read_source(const OpenField& /*field*/, const CityConfig& city,
                                 const ReadProgress& /*progress*/) {
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
  if (config.sea_level.geoid_undulation_m) {
    loaded.city.geoid_undulation_m = *config.sea_level.geoid_undulation_m;
  } else if (config.sea_level.geoid != buildings::GeoidModel::ByFile) {
    loaded.city.geoid_undulation_m = sea_level_m(config.sea_level.geoid, loaded.city.frame.origin());
  }
  return loaded;
}

namespace {

/// Bounds in longitude and latitude of points, with a margin [deg].
class GeographicBounds {
 public:
  void add(const geodesy::Geodetic& position) {
    box_.extend(
        Eigen::Vector2d(geodesy::degrees(position.longitude_rad), geodesy::degrees(position.latitude_rad)));
  }
  [[nodiscard]] std::optional<std::array<double, 4>> widened(double margin_m) const {
    constexpr double kMaxDegrees = 2;  // a longer trajectory needs a box
    if (box_.isEmpty() || box_.sizes().maxCoeff() > kMaxDegrees) return std::nullopt;
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

/// The trajectory and the fixed receivers; empty if the whole route is not known before the city.
GeographicBounds route_of(const Scenario& scenario) {
  GeographicBounds bounds;
  const TrajectoryConfig& trajectory = scenario.trajectory;
  std::set<std::size_t> unknown;
  for (const auto& [index, enu] : trajectory.local_waypoints) unknown.insert(index);
  for (std::size_t i = 0; i < trajectory.waypoints.size(); ++i)
    if (unknown.count(i) == 0) bounds.add(trajectory.waypoints[i]);
  if (trajectory.file) {
    HeightReading heights;
    heights.needed = false;
    for (const RecordedPoint& point : read_path(scenario, heights).points) bounds.add(point.position);
  }
  for (const ReceiverConfig& receiver : scenario.receivers)
    if (receiver.fixed && !receiver.fixed->local_m) bounds.add(receiver.fixed->position);
  return unknown.empty() ? bounds : GeographicBounds();
}

/// Reads a tileset, or a city model of tiles, without its own box only near these positions.
CityConfig about(CityConfig config, const GeographicBounds& points) {
  if (auto* tileset = config.as<tiles::TileOptions>(); tileset && !tileset->bbox_deg)
    tileset->bbox_deg = points.widened(tileset->margin_m);
  if (auto* map = config.as<MapCity>(); map && !map->bbox_deg && are_tiles(map->files))
    map->bbox_deg = points.widened(kRouteMargin_m);
  return config;
}

}  // namespace

CityConfig city_config(const Scenario& scenario) {
  return about(scenario.city, route_of(scenario));
}

CityConfig city_config(const Scenario& scenario, const std::array<double, 4>& bbox_deg) {
  const auto& [west, south, east, north] = bbox_deg;
  GeographicBounds box;
  box.add({geodesy::radians(south), geodesy::radians(west), 0});
  box.add({geodesy::radians(north), geodesy::radians(east), 0});
  return about(scenario.city, box);
}

namespace {

/// Cities of files with more triangles than this are cropped to the surroundings of the trajectory.
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
  const std::size_t dropped = city::crop(city.mesh, plan);
  city.notes.add_line(ReadReport::Level::Remark,
                      fmt::format("{} objects farther than {:g} m from the trajectory are left out", dropped,
                                  kRouteMargin_m));
}

city::City draw_buildings(city::City city, const CityConfig& config, std::uint64_t seed) {
  const bool keep = config.facades.keeps_named(config.is<MapCity>());
  const std::string sampled = city::assign_facades(city, config.facades, keep, seed);
  const std::string raised = city::raise_roofs(city, config.roofs_m, seed);
  for (const std::string& each : {sampled, raised})
    if (!each.empty()) city.notes.add_line(ReadReport::Level::Remark, each);
  city.seed = seed;
  return city;
}

}  // namespace

city::City load_city_source(const CityConfig& config) {
  CityConfig source = config;
  if (auto* map = source.as<MapCity>();
      map && config.facades.is_sampled() && config.facades.keeps_named(true))
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
    city.notes.add_line(ReadReport::Level::Remark, describe(*shift));
  }
  return city;
}

city::City load_city(const Scenario& scenario) {
  const GeographicBounds bounds = route_of(scenario);
  city::City source = load_city_source(about(scenario.city, bounds));
  const auto around = bounds.widened(kRouteMargin_m);
  if (scenario.city.is<CityFile>() && around && source.mesh.triangles.size() > kLargeCity)
    keep_about(source, *around);
  const auto* tileset = scenario.city.as<tiles::TileOptions>();
  if (tileset && tiles::holds_key(tileset->url)) {
    source.notes.add_line(
        ReadReport::Level::Guess,
        "city.tiles.url contains its key in clear text, and so will copies of the scenario: "
        "write $NAME instead and set that environment variable");
  }
  return draw_city(std::move(source), scenario);
}

}  // namespace canyon::simulation
