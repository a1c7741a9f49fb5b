#pragma once

#include <filesystem>

#include "canyon/buildings/sources/map_data.hpp"
#include "canyon/buildings/sources/map_options.hpp"

namespace canyon::buildings {

/// Reads CityJSON 1.0, 1.1 or 2.0, plain or gzip-compressed, or CityJSON text sequences (one CityJSONFeature
/// on each line after the first).
///
/// Building and BuildingPart objects become features: with `surfaces` of their highest LoD from 1 up to
/// `max_lod` (MultiSurface, CompositeSurface, outer shells of Solid, MultiSolid, CompositeSolid, with
/// semantics), else with `polygons` of an LoD 0 outline. A building whose parts have solids loses its own LoD
/// 0 outline. Ids are the objects' keys; parts name their building in belongs_to. Attributes that are text,
/// numbers or truth values become tags by their name; measuredHeight also "height", storeysAboveGround
/// "building:levels", facade/wall/roof material names "building:material" and "roof:material". Left out and
/// counted in warnings: GeometryInstance (templates), other city objects, objects without a usable geometry,
/// rings of fewer than three different points.
///
/// metadata.referenceSystem (EPSG, also compound, and OGC's CRS84) is transformed through GDAL's PROJ; x is
/// east or longitude and y north or latitude whatever the axis order of the authority, as CityJSON's software
/// writes them. (EPSG's own order for 4326 and 4979 is the other one: latitudes beyond +-90 are an error that
/// says so.) Heights become ellipsoidal as Geoid has it; where the grid of a vertical datum is not installed
/// they are taken as they are and a warning says so.
///
/// Throws InputError: not CityJSON (with the line), unknown version, no or unknown reference system, a bad
/// transform, an index out of range or a geometry of the wrong shape (with the object's key), no building.
[[nodiscard]] MapData read_cityjson(const std::filesystem::path& path, double max_lod = 2.3,
                                    const TerrainOptions& heights = {});

}  // namespace canyon::buildings
