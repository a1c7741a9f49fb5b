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
[[nodiscard]] double area(const Polygon2& polygon);               ///< [m^2], without the holes

/// Whether rings are too complex for GEOS: their sides cross or touch, other than at common corners, more
/// than `maximum` times plus 10 times per corner, or a polygon has more than 3,000 holes.
using PolygonLists = std::vector<const std::vector<Polygon2>*>;
[[nodiscard]] bool is_tangled(const PolygonLists& polygons, std::size_t maximum = 20'000);
inline constexpr std::size_t kMaxCrossings = 1000;  ///< of one outline

/// Makes valid polygons from rings of maps, with GEOS: orientation, repeated points, spikes, self-crossings,
/// holes that touch or cross the outer ring, overlapping outers. Merges points closer than 1 mm (to stay
/// distinct as floats), removes slivers below 0.01 m^2. Empty: nothing usable was left, or the rings are
/// tangled; `notes` gets the repair ("self-crossing outline") or the reason.
[[nodiscard]] std::vector<Polygon2> repair(const std::vector<Polygon2>& raw, std::vector<std::string>& notes);

/// a without b; a and b; or all of a: on the grid and clean as from repair(). Polygons must come from
/// repair(). Subtract and intersect omit pieces narrower than 2 cm on average (twice the area over the
/// perimeter): gaps between outlines that should share an edge. Throw InputError if all of the rings together
/// are tangled.
[[nodiscard]] std::vector<Polygon2> subtract(const std::vector<Polygon2>& a, const std::vector<Polygon2>& b);
[[nodiscard]] std::vector<Polygon2> intersect(const std::vector<Polygon2>& a, const std::vector<Polygon2>& b);
[[nodiscard]] std::vector<Polygon2> unite(const std::vector<Polygon2>& a);

/// The band along a line, `half_width_m` to each side, with flat ends and mitred corners. Empty for a tangled
/// line or one without length. @param half_width_m above 0
[[nodiscard]] std::vector<Polygon2> ribbon(const std::vector<Point2>& line, double half_width_m);

/// Largest distance of a feature from the origin; a larger one is a mistake.
inline constexpr double kFarthest_m = 200e3;

/// The lowest point of each feature that has its own surfaces: ellipsoidal heights [m].
[[nodiscard]] std::vector<double> lowest_heights_m(const MapData& map);

/// `wanted`, or the position described at BuildOptions::origin. Throws InputError for a map without any
/// position, features beyond kFarthest_m, and a terrain without a height there.
[[nodiscard]] geodesy::Geodetic choose_origin(const MapData& map, const Terrain* terrain,
                                              const std::optional<geodesy::Geodetic>& wanted);

/// Finds repeated outlines: the same corners (to a millimetre), area (to 0.1 m^2) and bottom.
class SameOutlines {
 public:
  /// The first item with this outline; if there is none, stores the item and returns nothing.
  [[nodiscard]] std::optional<std::size_t> add(std::size_t item, const std::vector<Polygon2>& polygons,
                                               double min_height_m);

 private:
  using Corners = std::vector<std::pair<std::int64_t, std::int64_t>>;
  struct VisitedPoint {
    std::size_t item = 0;
    double area_m2 = 0, min_height_m = 0;
    Corners corners;
  };
  std::unordered_map<std::size_t, std::vector<VisitedPoint>> by_hash_;
};

/// Distance of the trees of a row, the first at its beginning; at most 10,000 per row.
inline constexpr double kTreeSpacing_m = 8;
/// Positions of the trees of a Tree or TreeRow.
[[nodiscard]] std::vector<LonLat> tree_positions(const MapFeature& feature);

/// The properties of a building or part for assign_parts(). Polygons from repair(); keeps pointers to strings
/// and polygons, which must outlive it.
struct Outline {
  const std::string* id = nullptr;
  const std::string* belongs_to = nullptr;  ///< may be empty
  const std::vector<Polygon2>* polygons = nullptr;
};

/// A part is in a building if at least this fraction of its own area is.
inline constexpr double kPartInsideFraction = 0.5;

/// For each part the index of its building, or nothing for a separate part. The map's assignment
/// (`belongs_to` names the building, or a relation that the building also belongs to) has priority. Among
/// several such buildings, and without an assignment, the building with the largest common area is used;
/// without an assignment it must contain kPartInsideFraction of the part. A grid index finds buildings, so
/// the cost grows with the parts, not with parts times buildings.
[[nodiscard]] std::vector<std::optional<std::size_t>> assign_parts(const std::vector<Outline>& buildings,
                                                                   const std::vector<Outline>& parts);

/// Sum of the polygons' areas [m^2].
[[nodiscard]] double total_area(const std::vector<Polygon2>& polygons);

/// The rest of an outline without its parts: pieces of at least kMinPiece_m2 with a mean width (twice the
/// area over the perimeter) of at least kMinPieceWidth_m. Smaller pieces are drawing inaccuracies, no walls.
inline constexpr double kMinPiece_m2 = 4;
inline constexpr double kMinPieceWidth_m = 0.5;
[[nodiscard]] std::vector<Polygon2> uncovered(const std::vector<Polygon2>& outline,
                                              const std::vector<Polygon2>& parts);

}  // namespace canyon::buildings
