#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "canyon/city/mesh_topology.hpp"
#include "canyon/tiles/planar_regions.hpp"

namespace canyon::tiles {

/// Moves vertices of planar regions onto their planes: to a plane, to the line of two, or to the corner of
/// three. A vertex that would move by more than twice `distance_m` stays.
void flatten_regions(std::vector<Eigen::Vector3d>& vertices, const city::TriangleIndices& triangles,
                     const PlanarRegions& regions, double distance_m);

/// Triangles with a label each.
struct LabelledTriangles {
  city::TriangleIndices triangles;
  std::vector<std::uint32_t> labels;
};

/// Removes vertices by drawing an edge together to one of its ends, where the surface moves by at most
/// `distance_m` at the removed vertices and no triangle turns over. Borders between labels and the mesh's own
/// borders keep their ends and bends.
void decimate(const std::vector<Eigen::Vector3d>& vertices, LabelledTriangles& mesh, double distance_m);

/// The largest distance [m] of points from a surface. Precondition: at least one triangle.
[[nodiscard]] double farthest_from(const std::vector<Eigen::Vector3d>& points,
                                   const std::vector<Eigen::Vector3d>& vertices,
                                   const city::TriangleIndices& triangles);

}  // namespace canyon::tiles
