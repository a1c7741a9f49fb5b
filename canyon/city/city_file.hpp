#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <filesystem>

#include "canyon/city/fwd.hpp"

namespace canyon::city {

/// Canyon's own compact city file (.canyon): little-endian, versioned, zlib-compressed blocks with CRC-32,
/// vertices as float64, everything of City. Loads in well under a second for a district. Throws InputError if
/// the file cannot be written.
void write_city_file(const std::filesystem::path& path, const City& city);
/// Throws InputError: missing, not a Canyon city, a newer version, damaged or cut short (names the block).
[[nodiscard]] City read_city_file(const std::filesystem::path& path);

/// Reduces a large city to an area in plan (x, y [m]): drops the objects that do not touch the area, and the
/// triangles of terrain that do not. Returns the number of dropped objects.
std::size_t crop(Mesh& mesh, const Eigen::AlignedBox2d& plan);

}  // namespace canyon::city
