#include "canyon/simulation/read_map.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/buildings/sources/city_files.hpp"
#include "canyon/city/buildings/sources/geoid.hpp"
#include "canyon/city/buildings/sources/model_kind.hpp"
#include "canyon/city/buildings/sources/osm_reader.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::simulation {

namespace {

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
        box ? "the box is city.bbox, else for tiles 1 km around the trajectory: check positions, or give a "
              "box west,south,east,north with buildings"
            : "give a map with buildings");
  }
  return map;
}

}  // namespace

buildings::BuiltCity read_map(const MapCity& config, const CityConfig& city,
                              const std::function<void(std::size_t, std::size_t)>& progress) {
  // The rasters first: an invalid one is found before minutes of reading.
  std::optional<buildings::Terrain> terrain;
  if (!config.terrain.empty()) terrain.emplace(config.terrain, city.sea_level);
  buildings::BuildOptions build = config.build;
  build.origin = city.origin;
  build.validate();
  buildings::MapData map = read_maps(config, city.sea_level);
  if (!map.relief.empty() && terrain) {
    map.notes.add_line(ReadReport::Level::Remark,
                       map.source + ": its relief is left out, since city.terrain has height rasters");
  } else if (!map.relief.empty()) {
    terrain.emplace(buildings::Terrain::from_relief(map.relief));
    const auto beyond = std::count_if(map.features.begin(), map.features.end(), [&](const auto& feature) {
      return !terrain->height_m(feature.bounds().center());
    });
    const bool is_external = static_cast<std::size_t>(beyond) == map.features.size();
    if (is_external) terrain.reset();
    if (beyond > 0) {
      map.notes.add_line(
          ReadReport::Level::Loss,
          fmt::format("{}: {} of {} objects are outside the terrain, {}", map.source, beyond,
                      map.features.size(), is_external ? "which is left out" : "where there is no ground"));
    }
  }
  map.relief = {};
  return buildings::build_city(map, terrain ? &*terrain : nullptr, build, progress);
}

double sea_level_m(buildings::GeoidModel model, const geodesy::Geodetic& position) {
  return buildings::geoid_undulation_m(
      model, {geodesy::degrees(position.longitude_rad), geodesy::degrees(position.latitude_rad)});
}

}  // namespace canyon::simulation
