#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "canyon/drawing/canvas.hpp"
#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::drawing {

/// The direction of the viewer; see CityPictureOptions for the bounds.
struct ViewDirection {
  double elevation_rad = 0;  ///< of the viewer above the horizon, [0, pi/2]; pi/2 looks straight down
  double azimuth_rad = 0;    ///< compass direction in which the viewer is, seen from the city
  double field_rad = 0;      ///< opening angle across `picture`, [0, pi/2]; 0: parallel rays
};

/// Turns pixels into rays and places (ENU, m) into pixels. Pixels count from the top left corner of the
/// picture, x right, y down; the first pixel's middle is (0.5, 0.5).
class CityCamera {
 public:
  /// The camera from which all of `points` (at least one) lie in `area`, as large as they can be there: exact
  /// for parallel rays; with perspective the nearest eye for which they do, in closed form.
  /// @param area part of the picture for the points [px]; rays beyond it continue the same view
  /// @param picture_width_px width that view.field_rad opens over
  CityCamera(const std::vector<Eigen::Vector3d>& points, const Rect& area, double picture_width_px,
             const ViewDirection& view);

  /// The ray through a place of the picture; it starts in front of all points.
  [[nodiscard]] raytrace::Ray ray(double x, double y) const;
  /// The pixel of a place; empty behind the eye. ray() of the pixel meets the place, to rounding.
  [[nodiscard]] std::optional<Point> pixel(const Eigen::Vector3d& place) const;
  /// Width of a pixel [m] at the middle of the points.
  [[nodiscard]] double metres_per_pixel() const { return metres_per_pixel_; }
  /// Unit vector from the city to the viewer.
  [[nodiscard]] const Eigen::Vector3d& towards_viewer() const { return back_; }

 private:
  void fit_parallel(const std::vector<Eigen::Vector3d>& points, const Rect& area);
  void fit_perspective(const std::vector<Eigen::Vector3d>& points, const Rect& area);
  /// Right, up, and away from the viewer.
  [[nodiscard]] Eigen::Vector3d in_view(const Eigen::Vector3d& place) const {
    return {right_.dot(place), up_.dot(place), -back_.dot(place)};
  }
  [[nodiscard]] Eigen::Vector3d from_view(const Eigen::Vector3d& v) const {
    return v.x() * right_ + v.y() * up_ - v.z() * back_;
  }

  Eigen::Vector3d right_, up_, back_;
  Point centre_;         ///< [px] of the area; where the eye looks
  double focal_px_ = 0;  ///< 0: parallel
  double metres_per_pixel_ = 1;
  Eigen::Vector3d eye_;  ///< in view axes; parallel: on the plane from which rays start
};

}  // namespace canyon::drawing
