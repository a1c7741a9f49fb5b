#pragma once

#include <filesystem>

#include "canyon/city/fwd.hpp"
#include "canyon/city/mesh_marks.hpp"

namespace canyon::city {

/// Reads DAE, OBJ, STL, glTF/GLB or PLY (meshes::read_mesh_scene()), with the file's unit and up axis. A node
/// is terrain by its name, or, if no node has such a name, if it is a sheet: no front faces that face
/// sideways. Connected parts of a building node become separate objects. Degenerate triangles are dropped and
/// counted in notes. Part of canyon::io. Throws InputError for a missing or damaged file, an unknown format,
/// or no triangle at all.
///
/// Files written by Canyon (write_mesh(), detected by their mark) are read unchanged: each node is one
/// object, surfaces and materials are as written and no triangle is flipped. In other files a node whose name
/// begins with "building:", "terrain:", "foliage:" or "vehicle:" has that surface. City::notes contain a
/// guess that the city lies on its side if no up axis is given and its terrain, or the plane below its
/// buildings, is upright, or no roof is above the ground.
[[nodiscard]] City read_mesh_city(const std::filesystem::path& path, const MeshImportOptions& options);

/// The same for a part of a scene: of any size up to 200 km, and anywhere within 1,000 km.
[[nodiscard]] City read_mesh_part(const std::filesystem::path& path, const MeshImportOptions& options);

}  // namespace canyon::city
