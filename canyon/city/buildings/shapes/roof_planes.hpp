#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "canyon/city/buildings/shapes/footprint.hpp"
#include "canyon/city/buildings/sources/shape.hpp"

namespace canyon::buildings {

/// The rectangle around a footprint that a roof is fitted to: `across` is the direction [unit, east-north] in
/// which the roof slopes down, the ridge runs along the other one.
struct RoofRectangle {
  Point2 centre = Point2::Zero();
  Point2 along = Point2::UnitX();
  Point2 across = Point2::UnitY();
  double half_length_m = 0;  ///< along `along`; may be the shorter one
  double half_width_m = 0;   ///< along `across`
};

/// The smallest rectangle by area (one side lies on the convex hull), ridge along its longer side, or across
/// it where roof_across says so; of the two ways to slope down, the more southern. With roof_direction_rad,
/// `across` is that direction and the rectangle is the smallest one so turned; a direction within 11.25 deg
/// (half a point of the 16-point compass in which maps give it) of a side of the smallest rectangle means
/// that side. Precondition: at least three points, not all on a line.
[[nodiscard]] RoofRectangle roof_rectangle(const std::vector<Point2>& outer, const Shape& shape);

/// Sets roof_height_m of a shape with roof_angle_rad: the rise of its slope over the footprint (over the half
/// width of the rectangle, the whole of it where the roof is skillion, the shorter half where it is hipped,
/// mansard or pyramidal). The top stays, or where it was made of storeys the eaves do. Returns false, and
/// changes nothing, where the roof would be higher than the building.
[[nodiscard]] bool set_roof_by_angle(Shape& shape, const std::vector<Point2>& outer);

/// Height above the eaves [m]: offset + gradient . (p - origin).
struct RoofPlane {
  Point2 origin = Point2::Zero();
  Point2 gradient = Point2::Zero();
  double offset_m = 0;

  [[nodiscard]] double height_m(const Point2& p) const { return offset_m + gradient.dot(p - origin); }
};

/// Planes whose minimum is the roof over the rectangle, 0 at its lowest and `rise_m` at its highest: with w
/// and l the half width and half length, y and x the distances from the ridge and from the middle along it,
///   skillion   rise (w - y) / 2w, y signed towards `across`
///   gabled     rise (1 - y / w)
///   hipped     rise min(w - y, l - x) / min(w, l): the same pitch on all sides
///   pyramidal  rise min(1 - y / w, 1 - x / l): four faces that meet over the centre
///   gambrel    as gabled, bent: 3/4 of the rise over the outer half of the slope (60 and 30 deg where the
///              rise is 2 / sqrt(3) of the half width); mansard as hipped, bent likewise
///   round      the half ellipse with half axes w and rise, as 8 chords over equal angles
/// Empty for other shapes.
[[nodiscard]] std::vector<RoofPlane> roof_planes(RoofShape shape, const RoofRectangle& rectangle,
                                                 double rise_m);

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
