#pragma once

#include <filesystem>
#include <vector>

#include "canyon/city/buildings/sources/city_model.hpp"
#include "canyon/city/buildings/sources/map_data.hpp"

namespace canyon::buildings {

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
