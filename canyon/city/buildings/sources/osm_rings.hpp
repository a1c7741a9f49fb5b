#pragma once

#include <string>
#include <utility>
#include <vector>

#include "canyon/city/buildings/sources/osm_objects.hpp"

namespace canyon::buildings {

/// The ring of a closed way: last point and points repeated in a row taken out. Empty where the way is not
/// closed or has fewer than three corners; `problem` says which.
[[nodiscard]] MapRing ring_of(const OsmWay& way, std::string& problem);

/// Members that bound a multipolygon, as ways whose places are known, with their roles.
using RingMembers = std::vector<std::pair<const OsmWay*, std::string>>;

/// Polygons of a multipolygon relation by libosmium's area assembler: open ways are joined, roles decided by
/// the geometry. Where rings cross each other or themselves, closed member ways are taken by their roles as
/// they are (repair() makes the best of them) and `note` says so. Empty where neither works; `note` says why.
[[nodiscard]] std::vector<MapPolygon> assemble(OsmId id, const RingMembers& members, std::string& note);

/// True where polygons, line and box have a point in common (borders included; in degrees as if on a plane).
[[nodiscard]] bool touches(const MapFeature& feature, const LonLatBox& box);

}  // namespace canyon::buildings
