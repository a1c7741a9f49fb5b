#include "canyon/drawing/views/city_camera.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace canyon::drawing {

using Eigen::Vector3d;

namespace {

/// A single point, or points in line with the eye, must not be magnified without end.
constexpr double kSmallest_m = 1;

}  // namespace

CityCamera::CityCamera(const std::vector<Vector3d>& points, const Rect& area, double picture_width_px,
                       const ViewDirection& view)
    : centre_(area.centre()) {
  assert(!points.empty() && area.width > 0 && area.height > 0);
  const double se = std::sin(view.elevation_rad), ce = std::cos(view.elevation_rad);
  const double sa = std::sin(view.azimuth_rad), ca = std::cos(view.azimuth_rad);
  back_ = {sa * ce, ca * ce, se};
  right_ = {-ca, sa, 0};  // also where the viewer looks straight down: he has come from the azimuth
  up_ = back_.cross(right_);
  if (view.field_rad > 0) {
    focal_px_ = 0.5 * picture_width_px / std::tan(0.5 * view.field_rad);
    fit_perspective(points, area);
  } else {
    fit_parallel(points, area);
  }
}

void CityCamera::fit_parallel(const std::vector<Vector3d>& points, const Rect& area) {
  Vector3d low = Vector3d::Constant(1e300), high = Vector3d::Constant(-1e300);
  for (const Vector3d& p : points) {
    const Vector3d v = in_view(p);
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  const Vector3d size = high - low;
  metres_per_pixel_ = std::max(
      {size.x() / area.width, size.y() / area.height, kSmallest_m / std::max(area.width, area.height)});
  eye_ = 0.5 * (low + high);
  // Things that are not among the points, such as the ground's rim, may lie nearer than all points.
  eye_.z() = low.z() - 2 * size.norm() - kSmallest_m;
}

void CityCamera::fit_perspective(const std::vector<Vector3d>& points, const Rect& area) {
  // From an eye at (x, y, z), p is inside the right-hand bound where p.x - x <= (p.z - z) t, that is where
  // x - z t >= p.x - p.z t; likewise for the other three. Each pair of opposite bounds gives x (or y) and the
  // greatest z.
  const double tx = 0.5 * area.width / focal_px_, ty = 0.5 * area.height / focal_px_;
  double right = -1e300, left = -1e300, top = -1e300, bottom = -1e300, nearest = 1e300, middle = 0;
  for (const Vector3d& p : points) {
    const Vector3d v = in_view(p);
    right = std::max(right, v.x() - v.z() * tx);
    left = std::max(left, -v.x() - v.z() * tx);
    top = std::max(top, v.y() - v.z() * ty);
    bottom = std::max(bottom, -v.y() - v.z() * ty);
    nearest = std::min(nearest, v.z());
    middle += v.z() / static_cast<double>(points.size());
  }
  eye_ = {0.5 * (right - left), 0.5 * (top - bottom),
          std::min({-0.5 * (right + left) / tx, -0.5 * (top + bottom) / ty,
                    nearest - kSmallest_m / std::max(tx, ty)})};
  metres_per_pixel_ = (middle - eye_.z()) / focal_px_;
}

raytrace::Ray CityCamera::ray(double x, double y) const {
  const double dx = x - centre_.x, dy = centre_.y - y;
  if (focal_px_ > 0) return {from_view(eye_), from_view(Vector3d(dx, dy, focal_px_).normalized())};
  return {from_view(eye_ + Vector3d(dx, dy, 0) * metres_per_pixel_), -back_};
}

std::optional<Point> CityCamera::pixel(const Vector3d& place) const {
  const Vector3d v = in_view(place) - eye_;
  if (!(v.z() > 0)) return std::nullopt;
  const double scale = focal_px_ > 0 ? focal_px_ / v.z() : 1 / metres_per_pixel_;
  return Point{centre_.x + scale * v.x(), centre_.y - scale * v.y()};
}

}  // namespace canyon::drawing
