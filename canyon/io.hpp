#pragma once

/// canyon::io, in addition to the engine: cities from maps, meshes and Gazebo worlds, map files, pictures.
/// Link canyon::io, which includes canyon::canyon.

#include "canyon/analysis/heatmap/files/area_file.hpp"
#include "canyon/analysis/heatmap/files/geotiff_writer.hpp"
#include "canyon/analysis/heatmap/files/netcdf_writer.hpp"
#include "canyon/analysis/heatmap/files/stored_map.hpp"
#include "canyon/analysis/heatmap/pictures/map_pictures.hpp"
#include "canyon/canyon.hpp"
#include "canyon/city/buildings/city_builder.hpp"
#include "canyon/city/buildings/footprints_geojson.hpp"
#include "canyon/city/gazebo_export.hpp"
#include "canyon/city/gazebo_import.hpp"
#include "canyon/city/mesh_export.hpp"
#include "canyon/city/mesh_file.hpp"
#include "canyon/city/tiles/read_tiles.hpp"
#include "canyon/outputs/drawing/views/pictures.hpp"
#include "canyon/outputs/drawing/views/skyplot.hpp"
#include "canyon/simulation/load_city.hpp"
