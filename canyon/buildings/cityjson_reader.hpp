#pragma once

#include <filesystem>

#include "canyon/buildings/map_data.hpp"

namespace canyon::buildings {

/// Reads CityJSON 1.0, 1.1 or 2.0 (Building, BuildingPart; the highest LoD up to `max_lod`): MultiSurface and
/// Solid geometries with semantics, templates left out and counted; the transform applied;
/// metadata.referenceSystem (EPSG) turned to longitude, latitude and ellipsoidal height through GDAL's PROJ.
/// Features carry `surfaces`. Throws InputError: not CityJSON, unknown version, no or unknown reference
/// system, index out of range (with the object's key), no building.
[[nodiscard]] MapData read_cityjson(const std::filesystem::path& path, double max_lod = 2.3);

}  // namespace canyon::buildings
