#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "canyon/buildings/footprint.hpp"
#include "canyon/buildings/map_data.hpp"
#include "canyon/buildings/shape.hpp"
#include "canyon/buildings/terrain.hpp"
#include "canyon/city/city.hpp"

namespace canyon::buildings {

/// Which plane coordinates the mesh has. ENU is Canyon's world; UTM is for files that other tools place by
/// UTM, as the paper does (east and north of the origin's grid coordinates, z ellipsoidal height above the
/// origin).
enum class Grid : std::uint8_t { Enu, Utm };

struct BuildOptions {
  std::optional<geodesy::Geodetic> origin;  ///< empty: the middle of the features' bounds, ground level
  Grid grid = Grid::Enu;
  HeightDefaults heights;
  bool foliage = false;
  double terrain_margin_m = 200;  ///< ground beyond the outermost building; [0, 100,000]
  double terrain_spacing_m = 20;  ///< posts of the terrain sheet; [1, 1,000]
  double tree_height_m = 8;
  double tree_crown_m = 5;
  double wood_height_m = 12;
  void validate() const;
};

/// What became of one map feature, for GeoJSON and checks.
struct BuiltFeature {
  std::string id;
  bool built = false;
  std::string reason;                 ///< why not, or what was repaired
  std::vector<MapPolygon> footprint;  ///< after repair, lon/lat [deg]
  Shape shape;
  double ground_m = 0;  ///< ellipsoidal height of its base
  bool part = false;
  std::uint32_t first_object = 0, object_count = 0;  ///< in the city's mesh
};

struct BuildReport {
  std::size_t buildings = 0, parts = 0, trees = 0, woods = 0;  ///< built
  std::size_t outlines_replaced = 0;                           ///< buildings that their parts stand for
  std::size_t heights_tagged = 0, heights_from_levels = 0, heights_default = 0;
  std::size_t repaired = 0, skipped = 0;
  std::vector<std::string> warnings;  ///< with ids
};

struct BuiltCity {
  city::City city;
  BuildReport report;
  std::vector<BuiltFeature> features;
};

/// Map features to a city: heights and roofs by their tags, parts in place of outlines (what parts leave
/// uncovered keeps the outline's walls), standing on the terrain (or a flat ground at the origin's height,
/// named "terrain"). `progress` is called with features done and in all. Throws InputError where nothing can
/// be built.
[[nodiscard]] BuiltCity build_city(const MapData& map, const Terrain* terrain, const BuildOptions& options,
                                   const std::function<void(std::size_t, std::size_t)>& progress = {});

/// The report as lines for people.
[[nodiscard]] std::string format_report(const BuildReport& report);

}  // namespace canyon::buildings
