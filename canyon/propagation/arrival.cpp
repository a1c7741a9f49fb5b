#include "canyon/propagation/arrival.hpp"

#include <cmath>

namespace canyon::propagation {

bool Body::holds(const Eigen::Vector3d& point, double margin_m) const {
  const Eigen::Vector2d from = point.head<2>() - centre;
  const Eigen::Vector2d left(-ahead.y(), ahead.x());
  return std::abs(from.dot(ahead)) < half_length_m + margin_m &&
         std::abs(from.dot(left)) < half_width_m + margin_m && point.z() < top_m + margin_m &&
         (grounded || point.z() > bottom_m - margin_m);
}

Body body_of(const raytrace::PlacedInstance& instance) {
  const Eigen::Matrix3d rotation = instance.enu_from_instance.linear();
  const Eigen::Vector3d centre = instance.enu_from_instance * instance.bounds.center();
  Body body;
  // One that stands on its nose has no heading.
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
