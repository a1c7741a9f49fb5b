#include "canyon/simulation/motion/smooth_motion.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"

namespace canyon::simulation {

namespace {

constexpr int kDegree = 5;
using Weights = std::array<double, kDegree + 1>;

/// Weights of degree `degree` from those of one degree less; `u` is the fraction of a step after a knot.
Weights raised(const Weights& lower, int degree, double u) {
  Weights weights{};
  for (int j = 0; j <= degree; ++j) {
    const double before = j > 0 ? lower[static_cast<std::size_t>(j - 1)] : 0;
    const double here = j < degree ? lower[static_cast<std::size_t>(j)] : 0;
    weights[static_cast<std::size_t>(j)] = ((u + degree - j) * before + (j + 1 - u) * here) / degree;
  }
  return weights;
}

}  // namespace

UniformSpline::UniformSpline(std::vector<Value> points, double step_s)
    : points_(std::move(points)), step_s_(step_s) {}

UniformSpline::Point UniformSpline::at(double t_s) const {
  const auto last = static_cast<double>(points_.size() - 1);
  // The curve is at rest three steps beyond its ends.
  const double t = std::clamp(t_s / step_s_, -3.0, last + 3);
  const double knot = std::floor(t);
  const double u = t - knot;
  std::array<Weights, kDegree + 1> weights{};
  weights[0][0] = 1;
  for (int d = 1; d <= kDegree; ++d)
    weights[static_cast<std::size_t>(d)] = raised(weights[static_cast<std::size_t>(d - 1)], d, u);

  // Differences first, then means, so that small derivatives of large values keep their digits.
  std::array<Value, kDegree + 1> c;
  const auto maximum = static_cast<std::ptrdiff_t>(points_.size()) - 1;
  for (int j = 0; j <= kDegree; ++j) {
    const auto index = std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(knot) - 2 + j, 0, maximum);
    c[static_cast<std::size_t>(j)] = points_[static_cast<std::size_t>(index)];
  }
  const auto mean = [&](int degree) {
    Value sum = Value::Zero();
    for (int j = 0; j <= degree; ++j)
      sum += weights[static_cast<std::size_t>(degree)][static_cast<std::size_t>(j)] *
             c[static_cast<std::size_t>(j)];
    return sum;
  };
  const auto difference = [&](int count) {
    for (int j = 0; j < count; ++j) {
      const auto i = static_cast<std::size_t>(j);
      c[i] = (c[i + 1] - c[i]) / step_s_;
    }
  };
  Point point;
  // Relative to one of the points: the weights' sum is 1 only up to rounding.
  const Value about = c[2];
  for (Value& value : c) value -= about;
  point.value = about + mean(kDegree);
  difference(kDegree);
  point.rate = mean(kDegree - 1);
  difference(kDegree - 1);
  point.acceleration = mean(kDegree - 2);
  return point;
}

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

void SmoothMotion::add(double begin_s, double duration_s, const std::function<MotionKnot(double)>& motion) {
  // Knots are at -kReach_s + k kStep_s of the motion's time; the means need kBox - 1 more on either side.
  const auto count = static_cast<std::size_t>(std::ceil((duration_s + 2 * kReach_s) / kStep_s)) + 1;
  constexpr int kMore = kBox - 1;
  std::vector<UniformSpline::Value> values;
  values.reserve(count + 2 * static_cast<std::size_t>(kMore));
  for (int k = -kMore; k < static_cast<int>(count) + kMore; ++k) {
    const double t = std::clamp(k * kStep_s - kReach_s, -kReach_s, duration_s + kReach_s);
    const MotionKnot knot = motion(t);
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

Eigen::Matrix3d enu_from_ecef_at(const Vector3d& ecef_m) {
  using geodesy::kFlattening;
  constexpr double kA = geodesy::kSemiMajorAxis, kB = kA * (1 - kFlattening);
  constexpr double kE2 = kFlattening * (2 - kFlattening), kSecondE2 = kE2 / (1 - kE2);
  const double from_axis = std::hypot(ecef_m.x(), ecef_m.y());
  // The parametric latitude of the point as if it were on the ellipsoid.
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
