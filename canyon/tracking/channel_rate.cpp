#include "canyon/tracking/channel_rate.hpp"

#include <Eigen/Geometry>

#include "canyon/geodesy/constants.hpp"

namespace canyon::tracking {

double path_rate_mps(const orbit::LineOfSight& line, const Eigen::Vector3d& antenna_velocity_ecef,
                     const propagation::Path& path, const Eigen::Matrix3d& ecef_from_enu) {
  const Eigen::Vector3d& e = line.direction_ecef;
  const Eigen::Vector3d& satellite = line.velocity_at_reception_mps;
  if (path.kind == propagation::PathKind::Transmitted) return path.range_rate_mps;
  double rate = e.dot(satellite);
  if (path.kind == propagation::PathKind::Direct) {
    rate -= e.dot(antenna_velocity_ecef);
  } else {
    const Eigen::Vector3d arrival = ecef_from_enu * path.arrival;
    rate -= arrival.dot(antenna_velocity_ecef);
    const Eigen::Vector3d relative = satellite - antenna_velocity_ecef;
    const Eigen::Vector3d turning = (relative - e * e.dot(relative)) / line.range_m;
    const Eigen::Vector3d normal = e - arrival;
    const double squared = normal.squaredNorm();
    if (path.order == 2) {
      const Eigen::Vector3d between = path.point - path.far_point;
      rate += turning.dot(ecef_from_enu * between - path.leg_m * arrival + (path.leg_m + between.norm()) * e);
    } else if (squared > 1e-8) {  // at grazing incidence e and a agree and the excess is zero
      rate += 2 * path.excess_m * normal.dot(turning) / squared;
    }
  }
  const Eigen::Vector3d omega(0, 0, geodesy::kEarthRotationRate);
  const Eigen::Vector3d inertial = satellite + omega.cross(line.position_at_reception_m);
  return rate / (1 + e.dot(inertial) / geodesy::kSpeedOfLight);
}

}  // namespace canyon::tracking
