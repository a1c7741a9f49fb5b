#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/buildings/sources/map_data.hpp"
#include "canyon/city/buildings/sources/terrain.hpp"
#include "canyon/city/meshes/polygon.hpp"

namespace canyon::buildings {

using meshes::Point2;  ///< [m], east and north in the city's frame
using meshes::Polygon2;
using meshes::triangulate;
using meshes::twice_area;

[[nodiscard]] double perimeter(const std::vector<Point2>& ring);  ///< [m]
[[nodiscard]] double area(const Polygon2& polygon);               ///< [m^2], holes taken out

/// Whether rings ask more of GEOS than what they are worth: their sides cross or touch, beside at common
/// corners, more than `most` times and 10 times more for each corner, or a polygon has more than 3,000 holes.
using PolygonLists = std::vector<const std::vector<Polygon2>*>;
[[nodiscard]] bool is_tangled(const PolygonLists& polygons, std::size_t most = 20'000);
inline constexpr std::size_t kMostCrossings = 1000;  ///< of one outline

/// Makes valid polygons of rings as maps have them, with GEOS: orientation, repeated points, spikes,
/// self-crossings, holes that touch or cross the outer ring, overlapping outers. Points closer than 1 mm
/// become one (so that what leaves here stays distinct as floats), slivers below 0.01 m^2 vanish. An empty
/// result means that nothing certain was left, or that the rings are tangled; `notes`
/// gets what was repaired ("self-crossing outline") or why it is empty.
[[nodiscard]] std::vector<Polygon2> repair(const std::vector<Polygon2>& raw, std::vector<std::string>& notes);

/// a without b, a and b, or all of a: on the grid and clean as from repair(). Polygons must come from
/// repair(). Subtract and intersect leave out pieces narrower than 2 cm on average (twice the area over the
/// perimeter): seams between outlines that were meant to share an edge. Throw InputError where all of them
/// together are tangled.
[[nodiscard]] std::vector<Polygon2> subtract(const std::vector<Polygon2>& a, const std::vector<Polygon2>& b);
[[nodiscard]] std::vector<Polygon2> intersect(const std::vector<Polygon2>& a, const std::vector<Polygon2>& b);
[[nodiscard]] std::vector<Polygon2> unite(const std::vector<Polygon2>& a);

/// The band of a line, `half_width_m` to each side, cut off straight at its ends; corners are mitred. Empty
/// for a line without length or that is tangled. @param half_width_m above 0
[[nodiscard]] std::vector<Polygon2> ribbon(const std::vector<Point2>& line, double half_width_m);

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

/// Trees of a row stand this far apart, the first at its beginning; at most 10,000 of a row.
inline constexpr double kTreeSpacing_m = 8;
/// Where the trees of a Tree or TreeRow stand.
[[nodiscard]] std::vector<LonLat> tree_places(const MapFeature& feature);

/// A building or part as far as it matters for which part belongs where. Polygons from repair(); strings and
/// polygons are looked at, not kept.
struct Outline {
  const std::string* id = nullptr;
  const std::string* belongs_to = nullptr;  ///< may be empty
  const std::vector<Polygon2>* polygons = nullptr;
};

/// A part lies in a building when at least this share of its own area does.
inline constexpr double kPartInsideShare = 0.5;

/// For each part the index of the building it belongs to, or nothing for a part on its own. The map's word
/// (`belongs_to` names the building, or the relation that the building belongs to as well) goes first. Among
/// several such buildings, and where the map says nothing, the one that shares the largest area with the part
/// is taken; without a word of the map it must hold kPartInsideShare of it. Buildings are found through a
/// grid: the cost grows with the parts, not with parts times buildings.
[[nodiscard]] std::vector<std::optional<std::size_t>> assign_parts(const std::vector<Outline>& buildings,
                                                                   const std::vector<Outline>& parts);

/// Sum of the polygons' areas [m^2].
[[nodiscard]] double total_area(const std::vector<Polygon2>& polygons);

/// The rest of an outline without its parts: pieces of at least kLeastPiece_m2 whose mean
/// width (twice the area over the perimeter) is at least kLeastPieceWidth_m; less is how maps are drawn, not
/// a wall.
inline constexpr double kLeastPiece_m2 = 4;
inline constexpr double kLeastPieceWidth_m = 0.5;
[[nodiscard]] std::vector<Polygon2> uncovered(const std::vector<Polygon2>& outline,
                                              const std::vector<Polygon2>& parts);

}  // namespace canyon::buildings
