#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "canyon/buildings/shapes/footprint.hpp"

namespace canyon::buildings {

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
