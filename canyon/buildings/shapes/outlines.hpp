#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "canyon/buildings/shapes/footprint.hpp"
#include "canyon/buildings/sources/map_data.hpp"
#include "canyon/buildings/sources/terrain.hpp"
#include "canyon/geodesy/frames.hpp"

namespace canyon::buildings {

/// A city reaches at most this far from its origin; beyond it there is a mistake.
inline constexpr double kFarthest_m = 200e3;

/// The lowest point of each feature that has surfaces of its own: ellipsoidal heights [m].
[[nodiscard]] std::vector<double> lowest_heights_m(const MapData& map);

/// `wanted`, or the place that BuildOptions::origin describes. Throws InputError for a map without any place,
/// features beyond kFarthest_m, and a terrain without a height there.
[[nodiscard]] geodesy::Geodetic choose_origin(const MapData& map, const Terrain* terrain,
                                              const std::optional<geodesy::Geodetic>& wanted);

/// Finds outlines that were seen before: the same corners (to a millimetre), area (to 0.1 m^2) and bottom.
class SameOutlines {
 public:
  /// The first item with this outline, or nothing, and then the item is kept.
  [[nodiscard]] std::optional<std::size_t> add(std::size_t item, const std::vector<Polygon2>& polygons,
                                               double min_height_m);

 private:
  using Corners = std::vector<std::pair<std::int64_t, std::int64_t>>;
  struct Seen {
    std::size_t item = 0;
    double area_m2 = 0, min_height_m = 0;
    Corners corners;
  };
  std::unordered_map<std::size_t, std::vector<Seen>> by_hash_;
};

/// Whether a corner is sharper than 5 deg between sides of 50 m and more: a point of the map is damaged.
[[nodiscard]] bool has_spike(const std::vector<Polygon2>& polygons);

/// Trees of a row stand this far apart, the first at its beginning; at most 10,000 of a row.
inline constexpr double kTreeSpacing_m = 8;
/// Where the trees of a Tree or TreeRow stand.
[[nodiscard]] std::vector<LonLat> tree_places(const MapFeature& feature);

}  // namespace canyon::buildings
