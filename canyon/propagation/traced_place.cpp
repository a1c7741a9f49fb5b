#include "canyon/propagation/traced_place.hpp"

#include <algorithm>
#include <cmath>

namespace canyon::propagation {

using Eigen::Vector3d;

std::optional<Path> FarPath::seen_from(const Vector3d& antenna, const Vector3d& direction,
                                       const Vector3d& from_antenna, const Vector3d& from_direction) const {
  Path seen = path;
  const Vector3d step = antenna - from_antenna;
  const double turned_m =
      (direction - from_direction).dot(from_antenna - antenna_image(path, from_antenna, from_direction));
  if (path.kind == PathKind::Diffuse) {
    const Vector3d way = path.point - antenna;
    const double leg_m = way.norm();
    if (!(leg_m > 0)) return std::nullopt;
    seen.excess_m += turned_m + direction.dot(step) + leg_m - (path.point - from_antenna).norm();
    seen.arrival = way / leg_m;
    seen.arrival_elevation_rad = std::asin(std::clamp(seen.arrival.z(), -1.0, 1.0));
  } else {
    seen.excess_m += turned_m + (direction - path.arrival).dot(step);
    // The ray is moved by `step`, and the one that its mirror image is by the step's image.
    seen.leg_m = path.leg_m - normal.dot(step) / normal.dot(path.arrival);
    if (!(seen.leg_m > 0)) return std::nullopt;
    seen.point = antenna + seen.leg_m * path.arrival;
    const Vector3d onward = (path.far_point - path.point).normalized();
    const Vector3d image_step = step - 2 * normal.dot(step) * normal;
    seen.far_point =
        path.far_point + image_step - far_normal.dot(image_step) / far_normal.dot(onward) * onward;
  }
  seen.excess_m = std::max(0.0, seen.excess_m);
  return seen;
}

}  // namespace canyon::propagation
