#include "canyon/simulation/motion/uniform_spline.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace canyon::simulation {
namespace {

constexpr int kDegree = 5;
using Weights = std::array<double, kDegree + 1>;

/// Weights of degree `degree` from those of one degree less, `u` of a step behind a knot.
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

  // Differences are taken before the means, so that small derivatives of large values keep their digits.
  std::array<Value, kDegree + 1> c;
  const auto most = static_cast<std::ptrdiff_t>(points_.size()) - 1;
  for (int j = 0; j <= kDegree; ++j) {
    const auto index = std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(knot) - 2 + j, 0, most);
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
  // About one of the points: the weights' sum is 1 to the last digit alone.
  const Value about = c[2];
  for (Value& value : c) value -= about;
  point.value = about + mean(kDegree);
  difference(kDegree);
  point.rate = mean(kDegree - 1);
  difference(kDegree - 1);
  point.acceleration = mean(kDegree - 2);
  return point;
}

}  // namespace canyon::simulation
