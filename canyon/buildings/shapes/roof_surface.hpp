#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "canyon/buildings/shapes/footprint.hpp"
#include "canyon/buildings/shapes/roof_planes.hpp"

namespace canyon::buildings {

/// A footprint cut into triangles once, for floor and roof.
struct Plan {
  /// Triangulates. No triangles where triangulate() has none.
  explicit Plan(const Polygon2& polygon);

  std::vector<Point2> corners;                          ///< outer, then the holes
  std::vector<std::uint32_t> next;                      ///< corner after each one in its ring
  std::vector<std::uint32_t> first;                     ///< lowest corner at the same place (rings may touch)
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< of first corners, counter-clockwise
  bool has_holes = false;
};

/// A roof seen from above: triangles, counter-clockwise, that cover a footprint exactly; z is the height
/// above the eaves [m].
struct RoofSurface {
  std::vector<Eigen::Vector3d> vertices;  ///< the plan's corners in order, then what the roof adds
  std::vector<std::array<std::uint32_t, 3>> triangles;
  /// Vertices that the roof adds on the ring edge that begins at each corner, in order along it.
  std::vector<std::vector<std::uint32_t>> on_edge;
};

/// The plan at one height.
[[nodiscard]] RoofSurface flat_surface(const Plan& plan, double height_m = 0);

/// The minimum of planes over the plan, kept within [0, highest_m], cut where one plane gives way to another.
/// A cut that would pass a vertex within 1 mm goes through it, and the roof departs from the planes there by
/// no more than the slope times 1 mm. At least one plane.
[[nodiscard]] RoofSurface surface_of_planes(const Plan& plan, const std::vector<RoofPlane>& planes,
                                            double highest_m);

/// A roof whose level sections are the outline scaled about a centre: profile[i] = (scale, height), the first
/// one (1, 0), the last one (0, its height).
using RoofProfile = std::vector<Eigen::Vector2d>;
/// A quarter of an ellipse in 8 steps of equal angle.
[[nodiscard]] RoofProfile dome_profile(double rise_m);
/// An onion: swells to 1.18 of the outline at a fifth of its rise, then draws in to a tip.
[[nodiscard]] RoofProfile onion_profile(double rise_m);
/// A straight slope to the tip.
[[nodiscard]] RoofProfile spire_profile(double rise_m);

/// Empty where the outline has holes or is not star-shaped about its centroid: the line of an edge passes it
/// on the wrong side or nearer than 1 % of the square root of the area.
[[nodiscard]] std::optional<RoofSurface> surface_of_profile(const Plan& plan, const RoofProfile& profile);

}  // namespace canyon::buildings
