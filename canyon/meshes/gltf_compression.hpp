#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/meshes/polygon.hpp"

// The parts of compressed glTF that need other libraries. A build without them refuses such files and names
// the package.

namespace canyon::meshes {

/// The bytes of a buffer view that EXT_meshopt_compression packed: `count` elements of `stride` bytes.
/// Throws InputError for damaged data, more than 1,024 bytes for each packed byte, and in builds without
/// meshoptimizer.
[[nodiscard]] std::string unpack_meshopt(std::string_view packed, std::uint64_t count, std::uint64_t stride,
                                         const std::string& mode, const std::string& filter);

/// The attributes and triangles that are read of a Draco-compressed primitive.
struct DracoMesh {
  std::vector<Eigen::Vector3d> positions;
  std::vector<double> features;  ///< empty where not asked for
  TriangleIndices triangles;
};
/// Attributes by their unique numbers in the packed data; -1: none. Throws InputError for damaged data, and
/// in builds without Draco.
[[nodiscard]] DracoMesh unpack_draco(std::string_view packed, int position, int feature);

}  // namespace canyon::meshes
