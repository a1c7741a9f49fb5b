#include "canyon/simulation/motion/smooth_motion.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "canyon/geodesy/constants.hpp"

namespace canyon::simulation {

namespace {

/// Means over SmoothMotion::kBox neighbours; shorter by kBox - 1.
std::vector<UniformSpline::Value> box_means(const std::vector<UniformSpline::Value>& values) {
  constexpr std::size_t kBox = SmoothMotion::kBox;
  std::vector<UniformSpline::Value> means(values.size() - (kBox - 1));
  for (std::size_t i = 0; i < means.size(); ++i) {
    UniformSpline::Value sum = UniformSpline::Value::Zero();
    for (std::size_t k = 0; k < kBox; ++k) sum += values[i + k] - values[i];
    means[i] = values[i] + sum / static_cast<double>(kBox);
  }
  return means;
}

}  // namespace

void SmoothMotion::add(double begin_s, double duration_s, const std::function<MotionKnot(double)>& way) {
  // Knots of the curve stand at -kReach_s + k kStep_s of the way's time; the means need kBox - 1 more on
  // either side.
  const auto count = static_cast<std::size_t>(std::ceil((duration_s + 2 * kReach_s) / kStep_s)) + 1;
  constexpr int kMore = kBox - 1;
  std::vector<UniformSpline::Value> values;
  values.reserve(count + 2 * static_cast<std::size_t>(kMore));
  for (int k = -kMore; k < static_cast<int>(count) + kMore; ++k) {
    const double t = std::clamp(k * kStep_s - kReach_s, -kReach_s, duration_s + kReach_s);
    const MotionKnot knot = way(t);
    values.emplace_back(knot.position.x(), knot.position.y(), knot.position.z(), knot.yaw_rad);
  }
  points_ += count;
  stretches_.push_back(
      {begin_s, begin_s + duration_s + 2 * kReach_s, UniformSpline(box_means(box_means(values)), kStep_s)});
}

SmoothMotion::Point SmoothMotion::at(double t_s) const {
  const auto after = std::upper_bound(stretches_.begin(), stretches_.end(), t_s,
                                      [](double t, const Stretch& stretch) { return t < stretch.begin_s; });
  const Stretch& stretch = after == stretches_.begin() ? stretches_.front() : *std::prev(after);
  const UniformSpline::Point p =
      stretch.spline.at(std::clamp(t_s - stretch.begin_s, 0.0, stretch.end_s - stretch.begin_s));
  return {p.value.head<3>(), p.rate.head<3>(), p.acceleration.head<3>(), p.value[3], p.rate[3]};
}

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
