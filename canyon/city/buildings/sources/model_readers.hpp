#pragma once

#include <filesystem>
#include <vector>

#include "canyon/base/text_file.hpp"
#include "canyon/city/buildings/sources/city_model.hpp"
#include "canyon/city/buildings/sources/map_data.hpp"

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

/// Reads the files of a city model: CityGML and CityJSON by their content, each also as a zip archive or a
/// folder of any depth with many tiles, as authorities ship them, and several of these. Tiles are read in the
/// order of their names; an object that several of them have is taken once; each tile has its own reference
/// system.
///
/// A tile among many that is damaged is left out, and a warning names it with the line; a single file that is
/// damaged is an error. Files of archives and folders that are not city models are passed over.
///
/// CityGML 1.0, 2.0 and 3.0 is read object by object. Buildings with their parts and installations, bridges,
/// tunnels, other constructions and city furniture become features with `surfaces`: the best level of detail
/// up to CityReadOptions::model, of polygons with holes, of solids (outer shells), surfaces, triangulated
/// surfaces and implicit geometries, following references (xlink:href) within the file, forwards and
/// backwards. Thematic surfaces give the semantics; polygons that both a solid and a thematic surface have
/// are taken once. An object that has LoD 0 alone becomes an outline with `polygons`. Solitary vegetation
/// objects become trees, plant covers woods, reliefs of triangles MapData::relief. Everything else is counted
/// in warnings.
///
/// Coordinates are in the order of the authority's axes (latitude first for EPSG:6697), or in the other one
/// where only that lies in the system's area of use, or where both do and only then roofs look up (a warning
/// says so). Heights become ellipsoidal as Geoid has it.
///
/// Throws InputError as read_cityjson() does and with the line: read_gml()'s cases; for an archive that
/// unpacks to absurd sizes, and where no tile can be read.
[[nodiscard]] MapData read_city_files(const std::vector<std::filesystem::path>& paths,
                                      const CityReadOptions& options = {});

}  // namespace canyon::buildings
