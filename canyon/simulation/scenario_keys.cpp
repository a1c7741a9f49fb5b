// The table of every key of a scenario file. Defaults come from the structs that the keys fill.
#include <fmt/format.h>

#include <algorithm>

#include "canyon/buildings/sources/shape.hpp"
#include "canyon/simulation/scenario.hpp"
#include "canyon/simulation/scenario_keys.hpp"
#include "canyon/simulation/trajectory.hpp"

namespace canyon::simulation {
namespace {

void add_place(std::vector<ScenarioKey>& keys, const std::string& at, const std::string& what) {
  keys.insert(
      keys.end(),
      {{at + "latitude_deg", "deg", "", what + ": geodetic latitude (WGS 84)"},
       {at + "longitude_deg", "deg", "", "longitude, east positive"},
       {at + "height_m", "m", "", "ellipsoidal height; may be left out with height_above_terrain_m"},
       {at + "east_m", "m", "", "instead: east of the city's origin, with north_m and up_m"},
       {at + "north_m", "m", "", "north of the city's origin"},
       {at + "up_m", "m", "", "above the city's origin; may be left out with height_above_terrain_m"}});
}

std::vector<ScenarioKey> make_keys() {
  std::vector<ScenarioKey> keys;
  const auto add = [&keys](const char* path, const char* unit, std::string value, const char* meaning) {
    keys.push_back({path, unit, std::move(value), meaning});
  };
  const Scenario scenario;
  const CityConfig city;
  const city::SyntheticCityOptions synthetic;
  const TrajectoryConfig trajectory;
  const OutputConfig outputs;

  const MapCityConfig map;
  const buildings::HeightDefaults heights;

  add("city.osm", "", "",
      "map files, one or a list: .osm, .osm.gz, .osm.bz2, .osm.pbf, CityJSON .json (one of osm, file, mesh, "
      "synthetic, open)");
  add("city.file", "", "",
      "a city by its name's ending: .canyon and Gazebo's .world or .sdf (with an origin of their own), a map "
      "as "
      "under osm, or a mesh");
  add("city.mesh", "", "", "mesh file: DAE, OBJ, STL, glTF, PLY");
  add("city.terrain", "", "",
      "height rasters under a map, one or a list: GeoTIFF, SRTM HGT, anything GDAL reads");
  add("city.geoid_undulation_m", "m", "by the raster's vertical datum",
      "added to the heights of terrain and CityJSON to make them ellipsoidal");
  add("city.bbox", "deg", "the whole map", "[west, south, east, north]: only what touches this box of a map");
  add("city.level_height_m", "m", show(heights.level_m),
      "storey height of a map's buildings with levels and no height");
  add("city.default_height_m", "m", show(heights.building_m),
      "height where a map says neither height, levels nor a known type");
  add("city.heights", "m", "docs/city.md", "heights by building type: [house=7, office=20]");
  add("city.foliage", "", show(map.foliage), "trees, tree rows and woods of a map as well");
  add("city.origin.latitude_deg", "deg", "",
      "where the mesh's zero lies, or a map's shall (left out: its middle): geodetic latitude (WGS 84)");
  add("city.origin.longitude_deg", "deg", "", "longitude, east positive");
  add("city.origin.height_m", "m", show(city.import.origin.height_m), "ellipsoidal height");
  add("city.offset.east_m", "m", show(city.import.offset_m.x()), "moves the mesh in its ENU frame");
  add("city.offset.north_m", "m", show(city.import.offset_m.y()), "the same, northwards");
  add("city.offset.up_m", "m", show(city.import.offset_m.z()), "the same, upwards");
  add("city.heading_deg", "deg", show_deg(city.import.heading_rad),
      "turns the mesh counter-clockwise seen from above");
  add("city.scale", "", show(city.import.scale), "on top of the unit that the file declares");
  add("city.up_axis", "", "the file's", "Y or Z, where the file is wrong or says nothing");
  add("city.terrain_names", "", fmt::format("[{}]", fmt::join(city.import.terrain_names, ", ")),
      "words in node names that mark terrain");
  add("city.georeference.sigma_m", "m", show(city.georeference.sigma_m),
      "standard deviation of the city's place, eastwards and northwards: the whole city is moved once per "
      "run, drawn by the seed");
  add("city.georeference.heading_sigma_deg", "deg", show_deg(city.georeference.heading_sigma_rad),
      "standard deviation of its heading, about the middle of its bounds; likewise");
  add("city.synthetic.blocks_east", "blocks", show(synthetic.blocks_east),
      "a made-up downtown about the origin (default 22.3, 114.17): blocks from west to east; 'synthetic: {}' "
      "takes all defaults");
  add("city.synthetic.blocks_north", "blocks", show(synthetic.blocks_north), "blocks from south to north");
  add("city.synthetic.block_size_m", "m", show(synthetic.block_size_m), "side of a block");
  add("city.synthetic.street_width_m", "m", show(synthetic.street_width_m), "between blocks");
  add("city.synthetic.min_height_m", "m", show(synthetic.min_height_m), "lowest building");
  add("city.synthetic.max_height_m", "m", show(synthetic.max_height_m), "highest building");
  add("city.synthetic.seed", "", fmt::format("{}", synthetic.seed), "of the building heights");
  add("city.open", "", show(city.open), "true: no buildings at all, open sky about the origin");

  add("sky.navigation", "", "",
      "RINEX navigation files, one or a list, plain or gzip (one of navigation, sp3, nominal, frozen)");
  add("sky.sp3", "", "", "precise orbits, SP3-c or SP3-d, plain or gzip");
  add("sky.nominal", "", "true without another source",
      "the nominal constellations of GPS, GLONASS, Galileo and BeiDou at any date; needs no file");
  add("sky.frozen.satNum", "satellites", "the lists' length",
      "the paper's virtual satellites that never move");
  add("sky.frozen.satAzimuth", "rad", "", "their azimuths from north, clockwise");
  add("sky.frozen.satElevation", "rad", "", "their elevations");
  add("sky.systems", "", "all", "GPS, GLONASS, Galileo, BeiDou, QZSS: one or a list");
  add("sky.allow_stale", "", show(SkyConfig().allow_stale),
      "use ephemerides older than their system allows (and say so)");

  add("start", "UTC or GPST", "the trajectory's first time",
      "2019-04-28T12:58:03Z, or with ' GPST' behind it; a later one skips the trajectory's beginning. Needed "
      "where "
      "the trajectory has no times of its own");
  add("start.week", "weeks", "", "instead: full GPS week, as in 'start: {week: 2051, tow: 46701}'");
  add("start.tow", "s", "", "and seconds of that week");
  add("duration_s", "s", "the whole trajectory", "epochs from start to start + duration, both ends included");
  add("rate_hz", "Hz", "the trajectory's own, 1 for waypoints", "epochs per second");

  add("trajectory.file", "", "", "recorded positions (one of file, waypoints, position)");
  add("trajectory.format", "", trajectory.format.c_str(),
      "csv: time (ISO 8601, or seconds from start), latitude, longitude [deg], height [m]; urbannav: GPS "
      "week, time "
      "of week, latitude, longitude, height; nmea: GGA with RMC or ZDA");
  add("trajectory.height_above_terrain_m", "m", "heights as given",
      "puts the vehicle this high above the terrain");
  add_place(keys, "trajectory.waypoints[].", "corners of a drive in straight legs");
  add("trajectory.speed_mps", "m/s", show(trajectory.speed_mps), "along the legs between waypoints");
  add("trajectory.hold_s", "s", show(trajectory.hold_s), "standstill at each waypoint");
  add_place(keys, "trajectory.position.", "one place, for duration_s");

  add("receivers[].name", "", "rover", "names its outputs and its noise; needed with several receivers");
  add("receivers[].profile", "", "the defaults below",
      "one of 'canyon profiles', or a profile file; anything below overrides it");
  add_receiver_keys(keys, "receivers[].");

  add_propagation_keys(keys, "propagation.");
  add_noise_keys(keys, "noise.");
  add("seed", "", fmt::format("{}", scenario.seed), "of all noise: same seed, same bytes");

  add("outputs.epochs_csv", "", show(outputs.epochs_csv), "epochs.csv");
  add("outputs.satellites_csv", "", show(outputs.satellites_csv), "satellites.csv");
  add("outputs.nmea", "", show(outputs.nmea), "NMEA 0183");
  add("outputs.rinex_observation", "", show(outputs.rinex_observation), "RINEX 3.04 observations");
  add("outputs.rinex_navigation", "", show(outputs.rinex_navigation),
      "RINEX 3.04 navigation of the simulated sky");
  add("outputs.kml", "", show(outputs.kml), "track for Google Earth");
  add("outputs.geojson", "", show(outputs.geojson), "track for GIS programs");
  add("outputs.pictures", "", show(outputs.pictures), "track, sky plot and timeline as PNG and SVG");
  return keys;
}

}  // namespace

const std::vector<ScenarioKey>& scenario_keys() {
  static const std::vector<ScenarioKey> keys = make_keys();
  return keys;
}

std::string format_scenario_keys() {
  std::size_t width = 0;
  for (const ScenarioKey& key : scenario_keys()) width = std::max(width, key.path.size());
  std::string text;
  std::string group;
  for (const ScenarioKey& key : scenario_keys()) {
    const std::string section = key.path.substr(0, key.path.find_first_of(".["));
    if (section != group && !text.empty() && key.path.size() > section.size()) text += '\n';
    group = section;
    std::string facts = key.unit;
    if (!key.default_value.empty())
      facts += fmt::format("{}default {}", facts.empty() ? "" : ", ", key.default_value);
    text += fmt::format("  {:<{}}  {}{}\n", key.path, width, key.meaning,
                        facts.empty() ? "" : " [" + facts + "]");
  }
  return text;
}

}  // namespace canyon::simulation
