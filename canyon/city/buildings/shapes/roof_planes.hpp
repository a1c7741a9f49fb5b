#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "canyon/city/buildings/shapes/footprint.hpp"
#include "canyon/city/buildings/sources/shape.hpp"

namespace canyon::buildings {

/// The rectangle around a footprint that a roof is fitted to. The roof slopes down along `across` [unit,
/// east-north]; the ridge is parallel to `along`.
struct RoofRectangle {
  Point2 centre = Point2::Zero();
  Point2 along = Point2::UnitX();
  Point2 across = Point2::UnitY();
  double half_length_m = 0;  ///< along `along`; may be the shorter one
  double half_width_m = 0;   ///< along `across`
};

/// The smallest rectangle by area (one side is on the convex hull), ridge along its longer side, or along the
/// shorter one with roof_across; of the two slope directions, the more southern. With roof_direction_rad,
/// `across` is that direction and the rectangle is the smallest one with this orientation. A direction within
/// 11.25 deg (half a point of the 16-point compass used in maps) of a side of the smallest rectangle is
/// replaced by that side's. Precondition: at least three points, not all on a line.
[[nodiscard]] RoofRectangle roof_rectangle(const std::vector<Point2>& outer, const Shape& shape);

/// Sets roof_height_m of a shape with roof_angle_rad: the rise of the slope over the footprint (over the half
/// width of the rectangle; the full width for skillion; the shorter half for hipped, mansard or pyramidal).
/// The top is kept; if it was computed from storeys, the eaves are kept. Returns false, and changes nothing,
/// if the roof would be higher than the building.
[[nodiscard]] bool set_roof_by_angle(Shape& shape, const std::vector<Point2>& outer);

/// Height above the eaves [m]: offset + gradient . (p - origin).
struct RoofPlane {
  Point2 origin = Point2::Zero();
  Point2 gradient = Point2::Zero();
  double offset_m = 0;

  [[nodiscard]] double height_m(const Point2& p) const { return offset_m + gradient.dot(p - origin); }
};

/// Planes whose minimum is the roof over the rectangle, from 0 to `rise_m`; w and l are the half width and
/// half length, y and x the distances from the ridge and from the middle along it:
///   skillion   rise (w - y) / 2w, y signed towards `across`
///   gabled     rise (1 - y / w)
///   hipped     rise min(w - y, l - x) / min(w, l): the same pitch on all sides
///   pyramidal  rise min(1 - y / w, 1 - x / l): four faces that meet at the centre
///   gambrel    as gabled, with a kink: 3/4 of the rise over the outer half of the slope (60 and 30 deg if
///              the rise is 2 / sqrt(3) of the half width); mansard as hipped, with the same kink
///   round      the half ellipse with half axes w and rise, as 8 chords over equal angles
/// Empty for other shapes.
[[nodiscard]] std::vector<RoofPlane> roof_planes(RoofShape shape, const RoofRectangle& rectangle,
                                                 double rise_m);

/// A triangulated footprint, for floor and roof.
struct Plan {
  /// Triangulates. No triangles if triangulate() returns none.
  explicit Plan(const Polygon2& polygon);

  std::vector<Point2> corners;                          ///< outer, then the holes
  std::vector<std::uint32_t> next;                      ///< next corner of the ring
  std::vector<std::uint32_t> first;                     ///< lowest corner at the same point (rings may touch)
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< of first corners, counter-clockwise
  bool has_holes = false;
};

/// A roof seen from above: triangles, counter-clockwise, that cover a footprint exactly; z is the height
/// above the eaves [m].
struct RoofSurface {
  std::vector<Eigen::Vector3d> vertices;  ///< the plan's corners in order, then vertices added by the roof
  std::vector<std::array<std::uint32_t, 3>> triangles;
  /// Vertices added by the roof on the ring edge that begins at each corner, in order along it.
  std::vector<std::vector<std::uint32_t>> on_edge;
};

/// The plan at one height.
[[nodiscard]] RoofSurface flat_surface(const Plan& plan, double height_m = 0);

/// The minimum of planes over the plan, limited to [0, highest_m], cut along the intersections of the planes.
/// A cut within 1 mm of a vertex is moved to the vertex, so the roof deviates from the planes there by at
/// most the slope times 1 mm. At least one plane.
[[nodiscard]] RoofSurface surface_of_planes(const Plan& plan, const std::vector<RoofPlane>& planes,
                                            double highest_m);

/// A roof whose horizontal sections are the outline scaled about a centre: profile[i] = (scale, height), the
/// first one (1, 0), the last one (0, its height).
using RoofProfile = std::vector<Eigen::Vector2d>;
/// A quarter of an ellipse in 8 steps of equal angle.
[[nodiscard]] RoofProfile dome_profile(double rise_m);
/// An onion: widens to 1.18 of the outline at a fifth of its rise, then narrows to a tip.
[[nodiscard]] RoofProfile onion_profile(double rise_m);
/// A straight slope to the tip.
[[nodiscard]] RoofProfile spire_profile(double rise_m);

/// Empty if the outline has holes or is not star-shaped about its centroid: the line of an edge passes it on
/// the wrong side or closer than 1 % of the square root of the area.
[[nodiscard]] std::optional<RoofSurface> surface_of_profile(const Plan& plan, const RoofProfile& profile);

}  // namespace canyon::buildings
