#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace canyon::city {

enum class UpAxis : std::uint8_t { X, Y, Z };

/// A file's own statement about its axes and its unit.
struct FileFrame {
  double metres_per_unit = 1;
  UpAxis up = UpAxis::Z;
};

/// Rotation that makes z the up axis. Right stays right, towards the viewer becomes south (COLLADA 1.4.1,
/// "up_axis"; glTF 2.0, 3.4).
[[nodiscard]] Eigen::Matrix3d z_up_from(UpAxis up);

/// The largest file of a mesh, or that a mesh names [bytes]. Assimp holds a mesh several times over.
inline constexpr std::uint64_t kLargestMesh = std::uint64_t{2} << 30;

/// Whether a file that a mesh file names (buffer, library of materials) is there. Throws InputError where it
/// is no regular file, which Assimp would read for ever, or larger than kLargestMesh.
bool check_companion(const std::filesystem::path& path);

/// The number that a word of a mesh file is: parse_double() without Fortran's exponents ("1D1"), where Assimp
/// reads on from the D.
[[nodiscard]] std::optional<double> mesh_number(std::string_view word);
/// The cure for a word that is not one.
[[nodiscard]] std::string_view mesh_number_cure(std::string_view word);

/// A note where a comment states a unit other than metres, "# File units = millimeters", as modellers write
/// it in OBJ, PLY and the headers of binary STL, which have no field for it; else "".
[[nodiscard]] std::string unit_note(std::string_view comment);

/// Throws InputError for a PLY file that is no whole mesh, which Assimp does not notice or survive: data
/// shorter than the header promises, types and counts that are none, coordinates that are not finite, faces
/// without vertices or with vertices that are not there. Returns unit_note() of its comments.
[[nodiscard]] std::vector<std::string> check_ply(const std::filesystem::path& path);

/// Throws InputError where an ASCII STL file lacks its "endsolid" or has a facet without three corners of
/// three numbers, and a binary one whose size is not that of its triangles. Returns unit_note() of the
/// header of a binary file.
[[nodiscard]] std::vector<std::string> check_stl(const std::filesystem::path& path);

/// Throws InputError for vertices and faces of an OBJ file that have no numbers or name vertices that are not
/// there. Returns what may be damage, one line each: lines that are not OBJ, vertices without a face.
[[nodiscard]] std::vector<std::string> check_obj(const std::filesystem::path& path);

/// Throws InputError where a glTF file requires an extension that changes its geometry, such as Draco's or
/// meshopt's compression (glTF 2.0, 3.12), which Assimp does not look at, and where accessors, buffer views
/// or indices reach beyond what they refer to, and for other versions than 2. Returns what may be damage, one
/// line each: positions beyond their stated bounds, meshes in no scene, accessors without use, members that
/// glTF does not have.
[[nodiscard]] std::vector<std::string> check_gltf(const std::filesystem::path& path);

/// Throws InputError where counts of a COLLADA file do not agree with its arrays, and for references to what
/// is not there: Assimp 5.2 reads beyond its memory. Sets the unit and the up axis that the file declares.
/// Returns a line for geometries that no node shows.
[[nodiscard]] std::vector<std::string> check_collada(const std::filesystem::path& path, FileFrame& frame);

}  // namespace canyon::city
