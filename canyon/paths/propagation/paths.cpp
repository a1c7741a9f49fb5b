#include "canyon/paths/propagation/paths.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <tuple>
#include <utility>

namespace canyon::propagation {

std::string_view name(Visibility visibility) {
  static constexpr std::string_view kNames[]{"LOS", "LOS+multipath", "NLOS", "blocked"};
  return kNames[static_cast<std::size_t>(visibility)];
}

std::string_view name(PathKind kind) {
  static constexpr std::string_view kNames[]{"direct", "reflected", "diffracted", "diffuse", "spoofed"};
  return kNames[static_cast<std::size_t>(kind)];
}

Eigen::Vector3d antenna_image(const Path& path, const Eigen::Vector3d& antenna, const Eigen::Vector3d& s) {
  if (path.kind == PathKind::Direct) return antenna;
  const double leg = (path.point - antenna).norm();
  if (path.order < 2) return path.point - leg * s;
  return path.far_point - (leg + (path.far_point - path.point).norm()) * s;
}

bool comes_before(const Path& a, const Path& b) {
  const auto key = [](const Path& p) {
    return std::tie(p.excess_m, p.order, p.kind, p.instance, p.triangle, p.far_instance, p.far_triangle,
                    p.reflector);
  };
  const auto rank = [](PathKind kind) {
    return kind == PathKind::Direct ? 0 : kind == PathKind::Transmitted ? 2 : 1;
  };
  return std::pair(rank(a.kind), key(a)) < std::pair(rank(b.kind), key(b));
}

void SatellitePaths::arrange() {
  if (!std::is_sorted(paths.begin(), paths.end(), comes_before)) take(std::exchange(paths, {}));
  if (paths.empty() || paths.front().kind == PathKind::Transmitted) {
    visibility = Visibility::Blocked;
  } else if (paths.front().kind != PathKind::Direct) {
    visibility = Visibility::NLOS;
  } else {
    const bool reflected = std::any_of(paths.begin(), paths.end(),
                                       [](const Path& path) { return path.kind == PathKind::Reflected; });
    visibility = reflected ? Visibility::LOSMultipath : Visibility::LOS;
  }
}

void SatellitePaths::take(const std::vector<Path>& found) {
  // A path occupies six cache lines: each is copied once.
  static thread_local std::vector<const Path*> order;
  order.clear();
  for (const Path& path : found) order.push_back(&path);
  std::sort(order.begin(), order.end(), [](const Path* a, const Path* b) { return comes_before(*a, *b); });
  paths.clear();
  paths.reserve(found.size());
  for (const Path* path : order) paths.push_back(*path);
  arrange();
}

double SatellitePaths::tracked_excess_m() const {
  std::optional<double> shortest_m;
  for (const Path& path : paths) {
    if (path.kind == PathKind::Transmitted) continue;
    shortest_m = std::min(shortest_m.value_or(path.excess_m), path.excess_m);
  }
  return shortest_m.value_or(0);
}

double plane_rotation_rad(const Eigen::Vector3d& direction, const Eigen::Vector3d& first_normal,
                          const Eigen::Vector3d& second_normal) {
  const Eigen::Vector3d s1 = direction.cross(first_normal), s2 = direction.cross(second_normal);
  // Closer to the normal than this the plane of incidence is rounding noise.
  constexpr double kUndefined = 1e-9;
  if (s1.norm() < kUndefined || s2.norm() < kUndefined) return 0;
  return std::atan2(s1.cross(s2).dot(direction), s1.dot(s2));
}

bool Body::holds(const Eigen::Vector3d& point, double margin_m) const {
  const Eigen::Vector2d from = point.head<2>() - centre;
  const Eigen::Vector2d left(-ahead.y(), ahead.x());
  return std::abs(from.dot(ahead)) < half_length_m + margin_m &&
         std::abs(from.dot(left)) < half_width_m + margin_m && point.z() < top_m + margin_m &&
         (grounded || point.z() > bottom_m - margin_m);
}

double SatelliteView::direction_rate_radps() const {
  return line.direction_ecef.cross(line.velocity_at_reception_mps).norm() / line.range_m;
}

Body body_of(const raytrace::PosedInstance& instance) {
  const Eigen::Matrix3d rotation = instance.enu_from_instance.linear();
  const Eigen::Vector3d centre = instance.enu_from_instance * instance.bounds.center();
  Body body;
  // A vertical body has no heading.
  const Eigen::Vector2d nose = rotation.col(0).head<2>();
  if (nose.norm() > 1e-6) body.ahead = nose.normalized();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // of the box, as rows
  axes.topLeftCorner<2, 2>() << body.ahead.x(), body.ahead.y(), -body.ahead.y(), body.ahead.x();
  const Eigen::Vector3d half = (axes * rotation).cwiseAbs() * (0.5 * instance.bounds.diagonal());
  body.centre = centre.head<2>();
  body.half_length_m = half.x();
  body.half_width_m = half.y();
  body.bottom_m = centre.z() - half.z();
  body.top_m = centre.z() + half.z();
  body.name = instance.id;
  return body;
}

std::string_view name(Body::Kind kind) {
  static constexpr std::string_view kNames[]{"vehicle", "structure", "crown"};
  return kNames[static_cast<std::size_t>(kind)];
}

}  // namespace canyon::propagation
