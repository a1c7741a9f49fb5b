#include "canyon/simulation/motion/smooth_motion.hpp"

#include <algorithm>
#include <cmath>

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

}  // namespace canyon::simulation
