#pragma once

/// canyon::io beside the engine: cities from maps, meshes and Gazebo worlds, map files, pictures.
/// Link canyon::io, which brings canyon::canyon.

#include "canyon/buildings/city_builder.hpp"
#include "canyon/canyon.hpp"
#include "canyon/city/gazebo_export.hpp"
#include "canyon/city/mesh_export.hpp"
#include "canyon/city/mesh_file.hpp"
#include "canyon/drawing/views/pictures.hpp"
#include "canyon/drawing/views/skyplot.hpp"
#include "canyon/heatmap/engine/map_source.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/tiles/read_tiles.hpp"
