#pragma once

#include "canyon/base/text_file.hpp"
#include "canyon/city/buildings/sources/city_model.hpp"

namespace canyon::buildings {

/// Adds the objects of a file to a model. Reads CityJSON 1.0, 1.1 or 2.0, plain or gzip-compressed, or
/// CityJSON text sequences (one CityJSONFeature per line after the first).
///
/// Objects become features by CityModel: with `surfaces` of their best LoD from 1 up to
/// CityReadOptions::model (MultiSurface, CompositeSurface, outer shells of Solid, MultiSolid, CompositeSolid,
/// GeometryInstance, with semantics); else buildings with `polygons` of an LoD 0 outline. Ids are the
/// objects' keys; parts name their building in belongs_to. Attributes that are texts, numbers or booleans
/// become tags by their name, and by add_tags_of_attributes(). Omitted and counted in warnings: other city
/// objects, objects without a usable geometry, rings of fewer than three different points.
///
/// metadata.referenceSystem (EPSG, also compound, and OGC's CRS84) is transformed by GDAL's PROJ; x is east
/// or longitude and y north or latitude, independent of the authority's axis order, as CityJSON software
/// writes them. (EPSG's own order for 4326 and 4979 is the opposite; latitudes beyond +-90 are an error with
/// this explanation.) Heights become ellipsoidal by Geoid; if the grid of a vertical datum is not installed,
/// they are used unchanged, with a warning.
///
/// Throws InputError: not CityJSON (with the line), unknown version, no or unknown reference system without
/// ModelOptions::crs, a bad transform, an index out of range or a geometry of the wrong shape (with the
/// object's key), no object that can be built.
void read_cityjson(TextFile& file, CityModel& model);

}  // namespace canyon::buildings
