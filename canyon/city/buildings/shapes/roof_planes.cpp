#include "canyon/city/buildings/shapes/roof_planes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "canyon/city/mesh_topology.hpp"

namespace canyon::buildings {
namespace {
using city::cross;

constexpr int kRoundStrips = 8;
constexpr double kHalfCompassPoint_rad = M_PI / 16;

Point2 left_of(const Point2& direction) {
  return {-direction.y(), direction.x()};
}

/// Convex hull, counter-clockwise, without points on its sides (Andrew's monotone chain).
std::vector<Point2> convex_hull(std::vector<Point2> points) {
  std::sort(points.begin(), points.end(), [](const Point2& a, const Point2& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  std::vector<Point2> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t begin = hull.size();
    for (const Point2& p : points) {
      while (hull.size() >= begin + 2 &&
             cross(hull.back() - hull[hull.size() - 2], p - hull[hull.size() - 2]) <= 0) {
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();  // begins the other side
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

RoofRectangle fit(const std::vector<Point2>& hull, const Point2& across) {
  RoofRectangle fitted;
  fitted.across = across;
  fitted.along = -left_of(across);
  std::array<double, 2> low{}, high{};
  for (const Point2& p : hull) {
    const std::array<double, 2> at{fitted.along.dot(p - hull[0]), across.dot(p - hull[0])};
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], at[k]);
      high[k] = std::max(high[k], at[k]);
    }
  }
  fitted.centre =
      hull[0] + 0.5 * (low[0] + high[0]) * fitted.along + 0.5 * (low[1] + high[1]) * fitted.across;
  fitted.half_length_m = 0.5 * (high[0] - low[0]);
  fitted.half_width_m = 0.5 * (high[1] - low[1]);
  return fitted;
}

RoofRectangle smallest_rectangle(const std::vector<Point2>& hull) {
  RoofRectangle best;
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Point2 side = (hull[(i + 1) % hull.size()] - hull[i]).normalized();
    const RoofRectangle fitted = fit(hull, left_of(side));
    const double area = fitted.half_length_m * fitted.half_width_m;
    // Opposite and adjacent sides give the same rectangle but for rounding: the first of them stays.
    if (area < smallest * (1 - 1e-9)) {
      smallest = area;
      best = fitted;
    }
  }
  return best;
}

/// Both sides of the ridge (or of the middle along it) at a distance-dependent height a + b |distance|.
void add_pair(std::vector<RoofPlane>& planes, const Point2& origin, const Point2& direction, double a,
              double b) {
  planes.push_back({origin, b * direction, a});
  planes.push_back({origin, -b * direction, a});
}

}  // namespace

RoofRectangle roof_rectangle(const std::vector<Point2>& outer, const Shape& shape) {
  const std::vector<Point2> hull = convex_hull(outer);
  const RoofRectangle smallest = smallest_rectangle(hull);
  if (shape.roof_direction_rad) {
    Point2 down(std::sin(*shape.roof_direction_rad), std::cos(*shape.roof_direction_rad));
    for (const Point2& side : {smallest.along, smallest.across}) {
      for (const Point2& towards : {side, Point2(-side)}) {
        if (towards.dot(down) >= std::cos(kHalfCompassPoint_rad)) down = towards;
      }
    }
    return fit(hull, down);
  }
  const bool longer_is_along = smallest.half_length_m >= smallest.half_width_m;
  Point2 across = longer_is_along != shape.roof_across ? smallest.across : smallest.along;
  if (across.y() > 0 || (across.y() == 0 && across.x() > 0)) across = -across;
  return fit(hull, across);
}

bool set_roof_by_angle(Shape& shape, const std::vector<Point2>& outer) {
  if (!shape.roof_angle_rad) return true;
  const RoofRectangle rectangle = roof_rectangle(outer, shape);
  double run_m = rectangle.half_width_m;
  if (shape.roof == RoofShape::Skillion) run_m *= 2;
  if (shape.roof == RoofShape::Hipped || shape.roof == RoofShape::Mansard ||
      shape.roof == RoofShape::Pyramidal) {
    run_m = std::min(run_m, rectangle.half_length_m);
  }
  const double rise_m = run_m * std::tan(*shape.roof_angle_rad);
  const double added_m = shape.height_source == HeightSource::Levels ? rise_m - shape.roof_height_m : 0;
  if (shape.height_m + added_m - rise_m < shape.min_height_m) return false;
  shape.height_m += added_m;
  shape.roof_height_m = rise_m;
  return true;
}

std::vector<RoofPlane> roof_planes(RoofShape shape, const RoofRectangle& rectangle, double rise_m) {
  const double w = rectangle.half_width_m, l = rectangle.half_length_m, run = std::min(w, l), rise = rise_m;
  const Point2& o = rectangle.centre;
  const Point2 &along = rectangle.along, &across = rectangle.across;
  std::vector<RoofPlane> planes;
  // rise (from + slope * distance / run) where distance is measured inwards from the sides.
  const auto add_slopes = [&](bool all_sides, double from, double slope) {
    const double reach = all_sides ? run : w;
    add_pair(planes, o, across, rise * (from + slope * w / reach), -rise * slope / reach);
    if (all_sides) add_pair(planes, o, along, rise * (from + slope * l / reach), -rise * slope / reach);
  };
  switch (shape) {
    case RoofShape::Skillion:
      planes.push_back({o, -rise / (2 * w) * across, 0.5 * rise});
      break;
    case RoofShape::Gabled:
      add_slopes(false, 0, 1);
      break;
    case RoofShape::Hipped:
      add_slopes(true, 0, 1);
      break;
    case RoofShape::Pyramidal:
      add_pair(planes, o, across, rise, -rise / w);
      add_pair(planes, o, along, rise, -rise / l);
      break;
    case RoofShape::Gambrel:
    case RoofShape::Mansard: {
      // 0.75 rise at half the run: 1.5 d below, 0.5 + 0.5 d above.
      const bool all_sides = shape == RoofShape::Mansard;
      add_slopes(all_sides, 0, 1.5);
      add_slopes(all_sides, 0.5, 0.5);
      break;
    }
    case RoofShape::Round:
      for (int i = 0; i < kRoundStrips; ++i) {
        const double from = M_PI * i / kRoundStrips, to = M_PI * (i + 1) / kRoundStrips;
        const double y0 = -w * std::cos(from), y1 = -w * std::cos(to);
        const double slope = rise * (std::sin(to) - std::sin(from)) / (y1 - y0);
        planes.push_back({o, slope * across, rise * std::sin(from) - slope * y0});
      }
      break;
    case RoofShape::Flat:
    case RoofShape::Dome:
    case RoofShape::Onion:
      break;
  }
  return planes;
}

}  // namespace canyon::buildings
