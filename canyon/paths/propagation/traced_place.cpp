// Declared in canyon/paths/propagation/propagator.hpp.
#include "canyon/paths/propagation/propagator.hpp"

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

bool StandingInstance::is_like(const StandingInstance& other) const {
  constexpr double kMoved_m = 0.01, kTurned = 2e-3;
  const Eigen::Isometry3d &a = enu_from_instance, &b = other.enu_from_instance;
  return id == other.id && (a.translation() - b.translation()).norm() < kMoved_m &&
         (a.linear() - b.linear()).norm() < kTurned && bounds.isApprox(other.bounds);
}

std::vector<StandingInstance> instances_about(const raytrace::RayScene& scene, const Vector3d& antenna,
                                              double reach_m) {
  std::vector<StandingInstance> result;
  for (const raytrace::PlacedInstance& each : scene.placed_instances()) {
    const double far_m = (each.enu_from_instance * each.bounds.center() - antenna).norm();
    if (far_m - each.bounds.diagonal().norm() / 2 > reach_m) continue;
    result.push_back({each.id, each.enu_from_instance, each.bounds});
  }
  return result;
}

}  // namespace canyon::propagation
