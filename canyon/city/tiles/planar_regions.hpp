#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "canyon/city/mesh_topology.hpp"

namespace canyon::tiles {

inline constexpr std::uint32_t kNoRegion = 0xFFFFFFFF;

/// A connected group of triangles near one plane.
struct PlanarRegion {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, to the triangles' front
  double offset = 0;                                  ///< normal . x = offset on the plane
  double area_m2 = 0;
  std::uint32_t triangles = 0;
};

struct PlanarRegions {
  std::vector<std::uint32_t> of;  ///< region of each triangle; kNoRegion if it is in none
  std::vector<PlanarRegion> regions;
};

/// Grows regions from the flattest triangles, largest first; each region's plane is refitted, weighted by
/// area, during growth. A region has at least 3 m^2, and four triangles or 40 m^2: a single triangle is flat,
/// and tree crowns in coarse tiles have few, large ones. Vertices in metres, some km from the origin at most.
/// @param distance_m maximum distance of a region's vertices from its plane
[[nodiscard]] PlanarRegions find_regions(const std::vector<Eigen::Vector3d>& vertices,
                                         const city::TriangleIndices& triangles, double distance_m);

/// Moves vertices of planar regions onto their planes: to a plane, to the line of two, or to the corner of
/// three. A vertex that would move by more than twice `distance_m` is not moved.
void flatten_regions(std::vector<Eigen::Vector3d>& vertices, const city::TriangleIndices& triangles,
                     const PlanarRegions& regions, double distance_m);

/// Triangles with one label each.
struct LabelledTriangles {
  city::TriangleIndices triangles;
  std::vector<std::uint32_t> labels;
};

/// Removes vertices by collapsing an edge to one of its ends, if the surface moves by at most `distance_m` at
/// the removed vertices and no triangle flips. Borders of labels and of the mesh keep ends and bends.
void decimate(const std::vector<Eigen::Vector3d>& vertices, LabelledTriangles& mesh, double distance_m);

}  // namespace canyon::tiles
