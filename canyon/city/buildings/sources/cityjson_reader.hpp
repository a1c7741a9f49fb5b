#pragma once

#include "canyon/base/text_file.hpp"
#include "canyon/city/buildings/sources/city_model.hpp"

namespace canyon::buildings {

/// Adds the objects of a file to a model: of CityJSON 1.0, 1.1 or 2.0, plain or gzip-compressed, or CityJSON
/// text sequences (one CityJSONFeature on each line after the first).
///
/// Objects become features as CityModel has it: with `surfaces` of their best LoD from 1 up to
/// CityReadOptions::model (MultiSurface, CompositeSurface, outer shells of Solid, MultiSolid, CompositeSolid,
/// GeometryInstance, with semantics), buildings else with `polygons` of an LoD 0 outline. Ids are the
/// objects' keys; parts name their building in belongs_to. Attributes that are text, numbers or truth values
/// become tags by their name, and by add_tags_of_attributes(). Left out and counted in warnings: other city
/// objects, objects without a usable geometry, rings of fewer than three different points.
///
/// metadata.referenceSystem (EPSG, also compound, and OGC's CRS84) is transformed through GDAL's PROJ; x is
/// east or longitude and y north or latitude whatever the axis order of the authority, as CityJSON's software
/// writes them. (EPSG's own order for 4326 and 4979 is the other one: latitudes beyond +-90 are an error that
/// says so.) Heights become ellipsoidal as Geoid has it; where the grid of a vertical datum is not installed
/// they are taken as they are and a warning says so.
///
/// Throws InputError: not CityJSON (with the line), unknown version, no or unknown reference system while
/// ModelOptions::crs is not given either, a bad transform, an index out of range or a geometry of the wrong
/// shape (with the object's key), no object that can be built.
void read_cityjson(TextFile& file, CityModel& model);

}  // namespace canyon::buildings
