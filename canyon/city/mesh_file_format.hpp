#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>

namespace canyon::city {

enum class UpAxis : std::uint8_t { X, Y, Z };

/// A file's own statement about its axes and its unit.
struct FileFrame {
  double metres_per_unit = 1;
  UpAxis up = UpAxis::Z;
};

/// `<unit meter>` and `<up_axis>` of a COLLADA file's first `<asset>` (COLLADA 1.4.1 specification, "asset";
/// the defaults are 1 m and Y_UP). Assimp folds both into its root transform, in ways that differ from
/// version to version and in single precision; the importer therefore reads them here and sets that transform
/// aside. Throws InputError with the line where a value makes no sense.
[[nodiscard]] FileFrame collada_frame(const std::filesystem::path& path);

/// Rotation that makes z the up axis. Right stays right, towards the viewer becomes south (COLLADA 1.4.1,
/// "up_axis"; glTF 2.0, 3.4).
[[nodiscard]] Eigen::Matrix3d z_up_from(UpAxis up);

/// Throws InputError for a PLY file that is no whole mesh, which Assimp does not notice or survive: data
/// shorter than the header promises, types and counts that are none, coordinates that are not finite, faces
/// without vertices or with vertices that are not there.
void check_ply(const std::filesystem::path& path);

/// Throws InputError where an ASCII STL file lacks its "endsolid". Binary files are left to Assimp.
void check_stl_complete(const std::filesystem::path& path);

/// Throws InputError where a glTF file requires an extension that changes its geometry, such as Draco's or
/// meshopt's compression (glTF 2.0, 3.12), which Assimp does not look at.
void check_gltf_extensions(const std::filesystem::path& path);

}  // namespace canyon::city
