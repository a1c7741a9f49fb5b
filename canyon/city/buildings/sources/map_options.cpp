#include "canyon/city/buildings/sources/map_options.hpp"

#include <fmt/format.h>

#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"

namespace canyon::buildings {

void HeightDefaults::validate() const {
  options::check(*this);
}

void visit(options::Visitor& v, HeightDefaults& o) {
  v.number({"level_height_m", "m", "storey height of a map's buildings with levels and no height"}, o.level_m,
           {0, 20, true});
  v.number({"default_height_m", "m", "height if a map has neither height, levels nor a known type"},
           o.building_m, {0.1, 1000});
  v.named_numbers({"heights", "m", "heights by building type: [house=7, office=20]", "docs/city.md"},
                  o.by_type, {0.1, 1000}, "TYPE=METRES");
}

void TerrainOptions::validate() const {
  options::check(*this, "terrain");
  if (geoid_undulation_m && geoid != GeoidModel::ByFile)
    throw InputError("geoid conflicts with geoid_undulation_m", "keep one of them");
}

void visit(options::Visitor& v, TerrainOptions& o) {
  static constexpr std::string_view kGeoids[]{"by_file", "EGM84", "EGM96", "EGM2008"};
  // Geoid undulations are within -107 and +86 m (EGM2008).
  v.number({"geoid_undulation_m", "m",
            "height of mean sea level above the ellipsoid: added to the heights of terrain and city models, "
            "subtracted in NMEA, UBX, MAVLink and GPX",
            "by geoid"},
           o.geoid_undulation_m, {-150, 150});
  v.choice(
      {"geoid", "",
       "instead: a geoid with an installed grid, for heights without a vertical datum and for sea level; "
       "by_file: the datum named by the terrain or city model; without one, sea level is the ellipsoid"},
      o.geoid, kGeoids);
}

double ModelOptions::highest_lod() const {
  constexpr double kRefined = 0.99;  // of the same whole number
  constexpr double kExterior = 3;    // LoD 4 adds rooms
  const double level = lod.value_or(kExterior);
  return level == std::floor(level) ? level + kRefined : level;
}

std::string ModelOptions::lod_text() const {
  return lod ? fmt::format("{:g}", *lod) : "4";
}

void ModelOptions::validate() const {
  options::check(*this);
}

void visit(options::Visitor& v, ModelOptions& o) {
  v.number({"lod", "",
            "highest level of detail of CityGML and CityJSON: of each object the best one up to it; 2 takes "
            "2.2, too",
            "3, else 4"},
           o.lod, {0, 4});
  v.text({"crs", "",
          "reference system of CityGML and CityJSON files that name none: EPSG:25832, with heights "
          "EPSG:25832+7837",
          "the file's"},
         o.crs);
}

void BuildOptions::validate() const {
  if (origin) geodesy::check_geodetic(*origin, "origin");
  options::check(*this);
}

void visit(options::Visitor& v, BuildOptions& o) {
  visit(v, o.heights);
  v.boolean({"foliage", "", "also read trees, tree rows and woods of a map"}, o.foliage);
  v.boolean({"tunnels", "",
             "build roofs over a map's roads and railways with tunnel or covered, and walls along tunnels"},
            o.tunnels);
  v.boolean({"bridges", "", "build the decks of a map's bridges"}, o.bridges);
  v.number({"terrain_margin_m", "m", "margin of a map's terrain beyond the outermost building"},
           o.terrain_margin_m, {0, 100e3});
  v.number({"terrain_spacing_m", "m", "distance between the height posts of this terrain"},
           o.terrain_spacing_m, {1, 1000});
  v.number({"tree_height_m", "m", "height of trees without a height in the map"}, o.tree_height_m, {1, 150});
  v.number({"tree_crown_m", "m", "crown diameter of trees without one in the map"}, o.tree_crown_m,
           {0.5, 50});
  v.number({"wood_height_m", "m", "height of woods without a height in the map"}, o.wood_height_m, {1, 150});
}

}  // namespace canyon::buildings
