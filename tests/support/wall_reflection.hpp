#pragma once

#include <cmath>

#include "canyon/paths/propagation/paths.hpp"

namespace canyon::test {

/// The path of a satellite over a plane of metal that faces east, `distance_m` west of the city's origin.
inline propagation::Path wall_reflection(const propagation::Arrival& arrival,
                                         const propagation::SatelliteView& view, double distance_m) {
  const Eigen::Vector3d s = arrival.ecef_from_enu.transpose() * view.line.direction_ecef;
  const double height_m = arrival.antenna_enu.x() + distance_m;
  propagation::Path path;
  path.kind = propagation::PathKind::Reflected;
  path.order = 1;
  path.arrival = {-s.x(), s.y(), s.z()};
  path.point = arrival.antenna_enu + path.arrival * (height_m / s.x());
  path.excess_m = 2 * height_m * s.x();
  path.incidence_count = 1;
  path.incidences[0].material = city::Material::Metal;
  path.incidences[0].incidence_rad = std::acos(s.x());
  path.arrival_elevation_rad = std::asin(s.z());
  path.reflector = 77;
  return path;
}

}  // namespace canyon::test
