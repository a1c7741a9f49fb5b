#pragma once

#include <filesystem>
#include <vector>

#include "canyon/city/buildings/sources/city_model.hpp"
#include "canyon/city/buildings/sources/map_data.hpp"

namespace canyon::buildings {

/// Reads the files of a city model: CityGML and CityJSON by their content, each also as a zip archive or a
/// folder of any depth with many tiles, as authorities publish them, and several of these. Tiles are read in
/// the order of their names; repeated objects are read once; each tile has its own reference system.
/// A damaged tile among many is skipped with a warning that names the tile and the line; a single damaged
/// file is an error. Files of archives and folders that are not city models are ignored.
///
/// CityGML 1.0, 2.0 and 3.0 is read object by object. Buildings with their parts and installations, bridges,
/// tunnels, other constructions and city furniture become features with `surfaces`: the best level of detail
/// up to CityReadOptions::model, of polygons with holes, solids (outer shells), surfaces, triangulated
/// surfaces and implicit geometries. References (xlink:href) are followed within the file, forwards and
/// backwards. Thematic surfaces give the semantics; polygons in both a solid and a thematic surface are read
/// once. An object that has only LoD 0 becomes an outline with `polygons`. Solitary vegetation objects become
/// trees, plant covers woods, reliefs of triangles MapData::relief. Everything else is counted in warnings.
///
/// Coordinates are in the order of the authority's axes (latitude first for EPSG:6697), or in the other order
/// if only that is in the system's area of use, or if both are and roofs face up only in the other order
/// (with a warning). Heights become ellipsoidal by Geoid.
///
/// Throws InputError as read_cityjson() does and with the line: read_gml()'s cases; for an archive that
/// unpacks to an implausible size, and if no tile can be read.
[[nodiscard]] MapData read_city_files(const std::vector<std::filesystem::path>& paths,
                                      const CityReadOptions& options = {});

}  // namespace canyon::buildings
