#pragma once

#include <filesystem>

#include "canyon/city/fwd.hpp"
#include "canyon/city/mesh_marks.hpp"

namespace canyon::city {

/// Reads DAE, OBJ, STL, glTF/GLB or PLY (meshes::read_mesh_scene()); the file's unit and up axis are
/// honoured. A node is terrain by its name, or, where no name says so, when it is a sheet: no front faces
/// that look sideways. Connected parts of a building node become objects of their own. Degenerate triangles
/// are dropped and counted in notes. Part of canyon::io. Throws InputError for a missing or damaged file, an
/// unknown format, or no triangle at all.
///
/// Files that Canyon wrote (write_mesh(), by the mark in them) are taken at their word: each node is one
/// object, surfaces and materials are those that were written and no side is turned. In other files a node
/// whose name begins with "building:", "terrain:", "foliage:" or "vehicle:" is of that surface.
/// City::notes guess that the city lies on its side where no up axis is given and its terrain, or the plane
/// that its buildings stand on, is upright, or no roof is above the ground.
[[nodiscard]] City read_mesh_city(const std::filesystem::path& path, const MeshImportOptions& options);

/// The same for a part of a scene: of any size up to 200 km, and anywhere within 1,000 km.
[[nodiscard]] City read_mesh_part(const std::filesystem::path& path, const MeshImportOptions& options);

}  // namespace canyon::city
