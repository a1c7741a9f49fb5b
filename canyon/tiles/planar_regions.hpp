#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "canyon/city/mesh_topology.hpp"

namespace canyon::tiles {

inline constexpr std::uint32_t kNoRegion = 0xFFFFFFFF;

/// The triangle across each edge: [t][k] lies across the edge from corner k to k + 1 of t; kNoRegion where
/// none or several do.
[[nodiscard]] std::vector<std::array<std::uint32_t, 3>> neighbours(const city::TriangleIndices& triangles);

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

struct RegionRule {
  double distance_m = 0.3;   ///< of a region's vertices from its plane
  double cosine = 0.87;      ///< of the angle between a triangle's normal and the region's; at least
  double least_area_m2 = 3;  ///< smaller regions are none
  /// Smaller groups of triangles are no regions below `ample_area_m2`: a single triangle is always flat.
  std::uint32_t least_triangles = 1;
  double ample_area_m2 = 0;
};

/// Grows regions from the flattest triangles, largest first; each region's plane is fitted anew, by area, as
/// it grows. Vertices in metres, within some kilometres of the origin.
[[nodiscard]] PlanarRegions find_regions(const std::vector<Eigen::Vector3d>& vertices,
                                         const city::TriangleIndices& triangles, const RegionRule& rule);

}  // namespace canyon::tiles
