#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "canyon/city/buildings/shapes/footprint.hpp"
#include "canyon/city/buildings/sources/map_data.hpp"
#include "canyon/city/buildings/sources/map_options.hpp"
#include "canyon/city/buildings/sources/shape.hpp"
#include "canyon/city/buildings/sources/terrain.hpp"
#include "canyon/city/city.hpp"

namespace canyon::buildings {

/// The result for one map feature, for GeoJSON and checks.
struct BuiltFeature {
  std::string id;
  bool built = false;
  std::string reason;                 ///< reason if not built, else repairs
  std::vector<MapPolygon> footprint;  ///< after repair, lon/lat [deg]
  Shape shape;
  double ground_m = 0;  ///< ellipsoidal height of its base
  bool part = false;
  std::uint32_t first_object = 0, object_count = 0;  ///< in the city's mesh
};

/// Counts of built objects and of all guesses. Heights, roofs and materials are counted over buildings and
/// parts built from tags; features with their own surfaces (city models) are in `surveyed` instead.
struct BuildReport {
  std::size_t buildings = 0, parts = 0, trees = 0, woods = 0;  ///< built
  std::size_t outlines_replaced = 0;  ///< buildings replaced by their parts, not in `buildings`
  std::size_t outlines_cut = 0;       ///< in `buildings`: the area not covered by parts, or below the parts
  std::size_t parts_alone = 0;        ///< in `parts`: without a building outline
  std::size_t parts_beyond = 0;       ///< in `parts`: extend beyond their outline; kept unchanged
  std::size_t tunnels = 0, bridges = 0;  ///< of the map's roads and railways
  std::size_t structures = 0;            ///< bridges, tunnels, installations, city furniture of city models
  std::size_t surveyed = 0;  ///< in `buildings`, `parts` and `structures`: built from ready-made surfaces
  std::size_t heights_tagged = 0, heights_from_levels = 0, heights_default = 0;
  std::size_t heights_inherited = 0;  ///< parts without height or levels; they use their building's
  std::size_t roofs_default = 0;      ///< shaped roofs without a height in the map
  std::size_t materials_default = 0;  ///< facades without a known material
  std::size_t repaired = 0, skipped = 0;
  std::size_t foliage_left_out = 0;  ///< trees, tree rows and woods if foliage is not enabled
};

struct BuiltCity {
  city::City city;
  bool is_georeferenced = true;  ///< false: neither the source nor an option gives a position on the Earth
  BuildReport report;
  std::vector<BuiltFeature> features;
};

/// Builds a city from map features.
/// Positions: each corner of a footprint is converted to the frame, so positions are exact. A building is
/// upright in the frame, on one base: z of the lowest ground along its outline (OSM heights start there). On
/// a terrain its walls reach 1 m further down, so that no gap is left between posts. Verticals are parallel
/// to the frame's z: at distance d from the origin they tilt by d / 6,371 km against the local vertical (0.16
/// m over 100 m of height, 10 km away). Without a terrain the ground is a sheet at the origin's ellipsoidal
/// height, which is d^2 / 12,742 km below the frame's plane; posts are 500 m apart (error below 5 mm). The
/// ground is the first object, named "terrain".
///
/// Parts (Simple 3D Buildings) replace their outline; all use the outline's base. A part belongs to the
/// building that the map names, else to the outline that contains most, and at least half, of its area; other
/// parts are separate. The area without a part keeps the outline's walls (uncovered() omits small pieces), up
/// to the outline's eaves or the lowest top of its parts on the ground, with a flat roof. If no part reaches
/// the ground, the whole outline is built up to the lowest bottom of its parts. Space below a raised part
/// stays free if other parts of the building reach the ground. Parts without any height use their building's.
///
/// One object for each polygon (courtyards are its holes), named by the feature's id, followed by "#2", "#3",
/// ... if there are several. If two buildings have the same outline and bottom, only the first is built.
/// Trees of a row are 8 m apart; woods are flat-topped volumes over the mean ground of their outline.
///
/// `progress` is called with the numbers of finished and of all features. Throws InputError if nothing can be
/// built, if features are more than 200 km from the origin, and if the terrain does not cover the features
/// and the margin around them.
[[nodiscard]] BuiltCity build_city(const MapData& map, const Terrain* terrain, const BuildOptions& options,
                                   const std::function<void(std::size_t, std::size_t)>& progress = {});

/// The report as text lines.
[[nodiscard]] std::string format_report(const BuildReport& report);

}  // namespace canyon::buildings
