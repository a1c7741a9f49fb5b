#include "canyon/simulation/motion/antenna_pose.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

namespace canyon::simulation {

bool clamp_to_terrain(Pose& pose, const city::City& city, const raytrace::RayScene& scene, double height_m) {
  const geodesy::LocalFrame& frame = city.frame;
  if (city.mesh.triangles.empty()) {
    pose.position.height_m = frame.origin().height_m + height_m;
    pose.velocity_enu_mps.z() = 0;
    return true;
  }
  Eigen::Vector3d at = frame.local_from_geodetic(pose.position);
  const std::optional<double> terrain = scene.terrain_height(at.x(), at.y());
  if (!terrain) return false;
  const Eigen::Matrix3d city_from_enu = frame.ecef_from_local_rotation().transpose() *
                                        geodesy::enu_from_ecef_rotation(pose.position).transpose();
  Eigen::Vector3d velocity = city_from_enu * pose.velocity_enu_mps;
  // The vehicle follows the slope: its climb is that of the terrain a twentieth of a second before and after.
  constexpr double kAround_s = 0.05;
  const Eigen::Vector3d direction = velocity * kAround_s;
  const double ahead =
      scene.terrain_height(at.x() + direction.x(), at.y() + direction.y()).value_or(*terrain);
  const double after =
      scene.terrain_height(at.x() - direction.x(), at.y() - direction.y()).value_or(*terrain);
  velocity.z() = (ahead - after) / (2 * kAround_s);
  at.z() = *terrain + height_m;
  pose.position = frame.geodetic_from_local(at);
  pose.velocity_enu_mps = city_from_enu.transpose() * velocity;
  return true;
}

Pose mounted_antenna(Pose pose, const Eigen::Vector3d& lever) {
  if (lever.isZero(0)) return pose;
  const double c = std::cos(pose.yaw_rad);
  const double s = std::sin(pose.yaw_rad);
  // Roll, then pitch, then yaw. The level case gives unchanged bytes.
  Eigen::Vector3d body = lever;
  if (pose.roll_rad != 0 || pose.pitch_rad != 0) {
    body = Eigen::AngleAxisd(-pose.pitch_rad, Eigen::Vector3d::UnitY()) *
           (Eigen::AngleAxisd(pose.roll_rad, Eigen::Vector3d::UnitX()) * lever);
  }
  const Eigen::Vector3d enu(c * body.x() - s * body.y(), s * body.x() + c * body.y(), body.z());
  pose.velocity_enu_mps += pose.yaw_rate_radps * Eigen::Vector3d(-enu.y(), enu.x(), 0);
  pose.position =
      geodesy::geodetic_from_ecef(geodesy::ecef_from_geodetic(pose.position) +
                                  geodesy::enu_from_ecef_rotation(pose.position).transpose() * enu);
  return pose;
}

void tilt_antenna(propagation::Arrival& arrival, const Pose& pose, const geodesy::LocalFrame& frame) {
  if (pose.roll_rad == 0 && pose.pitch_rad == 0) return;
  const Eigen::Vector3d up = frame.ecef_from_local_rotation().transpose() *
                             (geodesy::enu_from_ecef_rotation(pose.position).transpose() * pose.up_enu());
  for (propagation::SatelliteView& view : arrival.views)
    for (propagation::Path& path : view.paths.paths)
      path.arrival_elevation_rad = std::asin(std::clamp(path.arrival.dot(up), -1.0, 1.0));
}

}  // namespace canyon::simulation
