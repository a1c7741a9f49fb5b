#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/city/fwd.hpp"

// Options for maps. In canyon::canyon, because scenarios contain them; their code is in canyon::io.

namespace canyon::buildings {

/// Heights for buildings without a height in the map; every use is counted.
struct HeightDefaults {
  double level_m = 3.0;     ///< storey height (OSM wiki, Simple 3D Buildings: about 3 m); (0, 20]
  double building_m = 9.0;  ///< any type not listed in by_type; [0.1, 1000]
  /// [0.1, 1000]
  std::map<std::string, double> by_type{{"house", 6},      {"detached", 6},    {"semidetached_house", 6},
                                        {"terrace", 6},    {"bungalow", 4},    {"hut", 3},
                                        {"shed", 3},       {"garage", 3},      {"garages", 3},
                                        {"carport", 3},    {"kiosk", 3},       {"roof", 4},
                                        {"greenhouse", 4}, {"apartments", 15}, {"residential", 12},
                                        {"office", 15},    {"commercial", 12}, {"retail", 6},
                                        {"hotel", 18},     {"industrial", 8},  {"warehouse", 8},
                                        {"church", 15},    {"cathedral", 25},  {"hospital", 15},
                                        {"school", 9},     {"university", 12}, {"train_station", 10},
                                        {"parking", 9}};
  /// Throws InputError with the field and its bound.
  void validate() const;
};
void visit(options::Visitor& v, HeightDefaults& o);

enum class GeoidModel : std::uint8_t { ByFile, EGM84, EGM96, EGM2008 };

/// The height reference of rasters and city models, and mean sea level in a city.
struct TerrainOptions {
  /// Ellipsoidal height minus height above mean sea level [m], within +-150, used unchanged for all heights.
  /// Empty: by `geoid`.
  std::optional<double> geoid_undulation_m;
  /// The geoid of heights whose file names no vertical datum (SRTM .hgt and DTED are EGM96 by their formats),
  /// and of mean sea level in the city; its grid must be installed. ByFile: heights without a datum are
  /// ellipsoidal, and mean sea level is the zero of the files' heights.
  GeoidModel geoid = GeoidModel::ByFile;
  /// Throws InputError with the bound, and if both are given.
  void validate() const;
};
void visit(options::Visitor& v, TerrainOptions& o);

/// Options for reading city models (CityGML, CityJSON).
struct ModelOptions {
  /// The highest level of detail to build; each object's best level up to it is used. A whole number includes
  /// its refined levels (2: also 2.2). [0, 4]. Empty: below 4, and 4 if an object has no other.
  std::optional<double> lod;
  /// The reference system of files without a known one: "EPSG:25832", with heights "EPSG:25832+7837".
  std::string crs;

  /// The highest level that may be used.
  [[nodiscard]] double highest_lod() const;
  /// "3", for messages.
  [[nodiscard]] std::string lod_text() const;
  /// Throws InputError with the bound.
  void validate() const;
};
void visit(options::Visitor& v, ModelOptions& o);

struct BuildOptions {
  /// Empty: the middle of the bounds of buildings and parts (foliage counts only if there are none) at ground
  /// level: the terrain's height there; without terrain the median of the lowest heights of features with
  /// their own surfaces; without these, 0.
  std::optional<geodesy::Geodetic> origin;
  HeightDefaults heights;
  bool foliage = false;
  bool tunnels = false;           ///< roads and railways with tunnel or covered get roofs, tunnels also walls
  bool bridges = false;           ///< roads and railways with bridge get decks
  double terrain_margin_m = 200;  ///< ground beyond the outermost building; [0, 100,000]
  double terrain_spacing_m = 20;  ///< posts of the terrain sheet; [1, 1,000]
  double tree_height_m = 8;       ///< of trees without a height tag; [1, 150]
  double tree_crown_m = 5;        ///< crown diameter of trees without diameter_crown; [0.5, 50]
  double wood_height_m = 12;      ///< of woods without a height tag; [1, 150]
  /// Facades without a known tag. Unknown lets city::assign_facades() distinguish them from tagged ones;
  /// there is no key for it.
  city::Material untagged_facade = city::Material::Concrete;
  /// Throws InputError with the field and its bound.
  void validate() const;
};
/// Visits all fields but `untagged_facade` and `origin`, which scenarios have for every city.
void visit(options::Visitor& v, BuildOptions& o);

}  // namespace canyon::buildings
