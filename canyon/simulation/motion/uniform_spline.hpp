#pragma once

#include <Eigen/Core>
#include <vector>

namespace canyon::simulation {

/// A quintic B-spline over control points in even steps of time: a curve that is four times continuously
/// differentiable. It is a mean of the control points with weights that are not negative, and so is each
/// derivative of their divided differences: what bounds these bounds the curve. It does not pass through the
/// control points. Before the first and behind the last one it rests there. Source: de Boor, A Practical
/// Guide to Splines, chapter IX. Immutable, thread-safe.
class UniformSpline {
 public:
  using Value = Eigen::Vector4d;
  struct Point {
    Value value, rate, acceleration;  ///< and the first two derivatives by time [1/s, 1/s^2]
  };

  /// @param points at least one, finite; point k stands at k step_s
  /// @param step_s above 0
  UniformSpline(std::vector<Value> points, double step_s);

  [[nodiscard]] Point at(double t_s) const;

 private:
  std::vector<Value> points_;
  double step_s_;
};

}  // namespace canyon::simulation
