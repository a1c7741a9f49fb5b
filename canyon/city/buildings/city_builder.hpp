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

/// The outcome for one map feature, for GeoJSON and checks.
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

/// Counts of built things and of every guess in them. Heights, roofs and materials are counted over buildings
/// and parts built from tags; features with surfaces of their own (city models) are in `surveyed` instead.
struct BuildReport {
  std::size_t buildings = 0, parts = 0, trees = 0, woods = 0;  ///< built
  std::size_t outlines_replaced = 0;  ///< buildings that their parts stand for, not in `buildings`
  std::size_t outlines_cut = 0;       ///< in `buildings`: what parts leave uncovered, or what is below them
  std::size_t parts_alone = 0;        ///< in `parts`: no building outline holds them
  std::size_t parts_beyond = 0;       ///< in `parts`: they reach beyond their outline, and are kept so
  std::size_t tunnels = 0, bridges = 0;  ///< of the map's roads and railways
  std::size_t structures = 0;            ///< bridges, tunnels, installations, city furniture of city models
  std::size_t surveyed = 0;  ///< in `buildings`, `parts` and `structures`: built from ready-made surfaces
  std::size_t heights_tagged = 0, heights_from_levels = 0, heights_default = 0;
  std::size_t heights_inherited = 0;  ///< parts without height or levels, which take their building's
  std::size_t roofs_default = 0;      ///< shaped roofs whose height the map does not say
  std::size_t materials_default = 0;  ///< facades without a material that is known
  std::size_t repaired = 0, skipped = 0;
  std::size_t foliage_left_out = 0;  ///< trees, tree rows and woods of the map that were not asked for
};

struct BuiltCity {
  city::City city;
  bool placed = true;  ///< false: the source says no place on the Earth, and nobody else does
  BuildReport report;
  std::vector<BuiltFeature> features;
};

/// Map features to a city.
///
/// Places: a footprint's corners go to the frame one by one, so positions are exact; a building then stands
/// upright in the frame, on one base: z of the lowest ground along its outline (OSM counts heights from
/// there). On a terrain its walls reach 1 m further down, so that no gap is left between posts. Verticals are
/// parallel to the frame's z: at distance d from the origin they lean by d / 6,371 km against the local
/// vertical (0.16 m over 100 m of height, 10 km away). Without a terrain the ground is a sheet at the
/// origin's ellipsoidal height, which falls off below the frame's plane as d^2 / 12,742 km; posts are 500 m
/// apart (error below 5 mm). Either is the first object, named "terrain".
///
/// Parts (Simple 3D Buildings) stand in place of their outline, all on the outline's base. A part belongs to
/// the building that the map names, else to the outline that holds most, and at least half, of its area;
/// others stand alone. The area without a part keeps the outline's walls (uncovered() leaves out what is too
/// little), up to the outline's eaves or the lowest top of its parts on the ground, with a flat roof. Where
/// no part reaches the ground the outline stays whole, up to the lowest bottom of its parts. Space below a
/// raised part stays free where other parts of the building do stand on the ground. Parts without any height
/// take their building's.
///
/// One object for each polygon (courtyards are holes of it), named by the feature's id, "#2", "#3", ...
/// behind it where there are several. Where two buildings have the same outline and bottom, only the first
/// is built.
///
/// Trees of a row stand 8 m apart; woods are flat-topped volumes over the mean ground of their outline.
///
/// `progress` is called with features done and in all. Throws InputError where nothing can be built, where
/// features lie more than 200 km from the origin, and where the terrain
/// does not cover the features and the margin about them.
[[nodiscard]] BuiltCity build_city(const MapData& map, const Terrain* terrain, const BuildOptions& options,
                                   const std::function<void(std::size_t, std::size_t)>& progress = {});

/// The report as lines for people.
[[nodiscard]] std::string format_report(const BuildReport& report);

}  // namespace canyon::buildings
