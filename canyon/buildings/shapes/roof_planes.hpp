#pragma once

#include <vector>

#include "canyon/buildings/shapes/footprint.hpp"
#include "canyon/buildings/sources/shape.hpp"

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

}  // namespace canyon::buildings
