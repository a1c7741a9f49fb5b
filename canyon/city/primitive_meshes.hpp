#pragma once

#include <Eigen/Core>
#include <vector>

#include "canyon/city/mesh_topology.hpp"

namespace canyon::city {

/// Triangles on their own, front sides outwards; metres.
struct TriangleSet {
  std::vector<Eigen::Vector3d> vertices;
  TriangleIndices triangles;
};

/// A box about the origin; `size` positive.
[[nodiscard]] TriangleSet box_mesh(const Eigen::Vector3d& size);
/// A closed prism inscribed in a cylinder about the origin, axis z, with so many sides: its radius is met at
/// the edges and short by a factor cos(pi / sides) between them (0.5 % for 32).
[[nodiscard]] TriangleSet cylinder_mesh(double radius, double length, int sides = 32);
/// A closed polyhedron inscribed in a sphere about the origin: `sides` meridians, half as many parallels.
[[nodiscard]] TriangleSet sphere_mesh(double radius, int sides = 32);
/// A closed pyramid inscribed in a cone about the origin: its base at -length / 2, its tip at length / 2 of
/// z.
[[nodiscard]] TriangleSet cone_mesh(double radius, double length, int sides = 32);
/// A closed polyhedron inscribed in a cylinder about the origin, axis z, between two half spheres; `length`
/// of the cylinder alone, 0 or more. `sides`, a multiple of 4, as of cylinder and sphere.
[[nodiscard]] TriangleSet capsule_mesh(double radius, double length, int sides = 32);
/// sphere_mesh() stretched to half axes `radii` along x, y and z.
[[nodiscard]] TriangleSet ellipsoid_mesh(const Eigen::Vector3d& radii, int sides = 32);
/// A rectangle about the origin in the plane of a unit normal, front side where the normal points. Its axes
/// are x and y turned the shortest way from z to the normal.
[[nodiscard]] TriangleSet plane_mesh(const Eigen::Vector3d& normal, const Eigen::Vector2d& size);

}  // namespace canyon::city
