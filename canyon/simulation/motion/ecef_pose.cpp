#include "canyon/simulation/motion/ecef_pose.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "canyon/geodesy/constants.hpp"

namespace canyon::simulation {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

Eigen::Matrix3d enu_from_body(const Pose& pose) {
  return (AngleAxisd(pose.yaw_rad, Vector3d::UnitZ()) * AngleAxisd(-pose.pitch_rad, Vector3d::UnitY()) *
          AngleAxisd(pose.roll_rad, Vector3d::UnitX()))
      .toRotationMatrix();
}

Eigen::Matrix3d enu_from_ecef_at(const Vector3d& ecef_m) {
  using geodesy::kFlattening;
  constexpr double kA = geodesy::kSemiMajorAxis, kB = kA * (1 - kFlattening);
  constexpr double kE2 = kFlattening * (2 - kFlattening), kSecondE2 = kE2 / (1 - kE2);
  const double from_axis = std::hypot(ecef_m.x(), ecef_m.y());
  // The parametric latitude of the point as if it was on the ellipsoid.
  const Vector3d parametric = Vector3d(kB * from_axis, kA * ecef_m.z(), 0).normalized();
  const double c = parametric.x(), s = parametric.y();
  const Vector3d latitude =
      Vector3d(from_axis - kE2 * kA * c * c * c, ecef_m.z() + kSecondE2 * kB * s * s * s, 0).normalized();
  const double east_x = -ecef_m.y() / from_axis, east_y = ecef_m.x() / from_axis;
  const double cos_latitude = latitude.x(), sin_latitude = latitude.y();
  Eigen::Matrix3d rotation;
  rotation << east_x, east_y, 0,                                    //
      -sin_latitude * east_y, sin_latitude * east_x, cos_latitude,  //
      cos_latitude * east_y, -cos_latitude * east_x, sin_latitude;
  return rotation;
}

}  // namespace canyon::simulation
