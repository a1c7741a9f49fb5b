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
  std::vector<std::uint32_t> of;  ///< region of each triangle; kNoRegion where it is in none
  std::vector<PlanarRegion> regions;
};

/// Grows regions from the flattest triangles, largest first; each region's plane is fitted anew, by area, as
/// it grows. A region has 3 m^2, and four triangles or 40 m^2: a single triangle is always flat, and crowns
/// in coarse tiles have few and large ones. Vertices in metres, within some kilometres of the origin.
/// @param distance_m of a region's vertices from its plane, at most
[[nodiscard]] PlanarRegions find_regions(const std::vector<Eigen::Vector3d>& vertices,
                                         const city::TriangleIndices& triangles, double distance_m);

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

}  // namespace canyon::tiles
