#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::simulation {

/// A quintic B-spline over control points in even steps of time: a curve that is four times continuously
/// differentiable. It is a weighted mean of the control points with non-negative weights, and so is each
/// derivative of their divided differences: bounds of these are bounds of the curve. It does not pass through
/// the control points. Before the first and after the last one it is constant. Source: de Boor, A Practical
/// Guide to Splines, chapter IX. Immutable, thread-safe.
class UniformSpline {
 public:
  using Value = Eigen::Vector4d;
  struct Point {
    Value value, rate, acceleration;  ///< and its first two derivatives by time [1/s, 1/s^2]
  };

  /// @param points at least one, finite; point k is at time k step_s
  /// @param step_s above 0
  UniformSpline(std::vector<Value> points, double step_s);

  [[nodiscard]] Point at(double t_s) const;

 private:
  std::vector<Value> points_;
  double step_s_;
};

/// A position and a heading before smoothing.
struct MotionKnot {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< in any Cartesian frame [m]
  double yaw_rad = 0;                                  ///< continuous: no jumps of 2 pi
};

/// A motion whose acceleration is continuous and twice differentiable, in a Cartesian frame: segments of
/// movement with rest between them. Each segment is a function of time that is averaged twice over kBox_s,
/// then approximated by a B-spline with knots kStep_s apart. These are means over time with non-negative
/// weights. So speed and acceleration do not exceed those of the function, and the jerk is at most the
/// largest step of its acceleration over kBox_s. The path cuts a corner of acceleration a by up to
/// kVariance_s2 a / 2. Immutable, thread-safe.
class SmoothMotion {
 public:
  static constexpr double kStep_s = 0.1;
  static constexpr int kBox = 9;  ///< steps of a mean, odd
  static constexpr double kBox_s = kBox * kStep_s;
  /// Half width of all means [s]: a segment's motion begins and ends this long before and after its `route`.
  static constexpr double kReach_s = (kBox - 1 + 3) * kStep_s;
  /// Variance of the weights: of two boxes of nine steps and a quintic spline.
  static constexpr double kVariance_s2 = (2 * (kBox * kBox - 1) / 12.0 + 0.5) * kStep_s * kStep_s;

  struct Point {
    Eigen::Vector3d position, velocity, acceleration;  ///< [m, m/s, m/s^2]
    double yaw_rad, yaw_rate_radps;
  };

  /// Adds a segment that moves from `begin_s` on. Precondition: `begin_s` is not before end_s(). @param
  /// distance motion at seconds after its own begin; called within [-kReach_s, duration_s + kReach_s] @param
  /// duration_s of that motion; the segment lasts 2 kReach_s longer
  void add(double begin_s, double duration_s, const std::function<MotionKnot(double)>& motion);

  /// End of the last segment; 0 without any.
  [[nodiscard]] double end_s() const { return stretches_.empty() ? 0 : stretches_.back().end_s; }
  /// It is at rest before, after and between segments. Precondition: there is a segment.
  [[nodiscard]] Point at(double t_s) const;
  /// Number of control points.
  [[nodiscard]] std::size_t points() const { return points_; }

 private:
  struct Stretch {
    double begin_s, end_s;
    UniformSpline spline;
  };
  std::vector<Stretch> stretches_;
  std::size_t points_ = 0;
};

/// geodesy::enu_from_ecef_rotation() at a point in ECEF [m], without its geodetic coordinates: the
/// ellipsoid's normal by one step of Bowring (Transformation from spatial to geographical coordinates, Survey
/// Review 23, 1976). Accurate within 1e-12 below 10 km of height. The point must not be on the Earth's axis.
[[nodiscard]] Eigen::Matrix3d enu_from_ecef_at(const Eigen::Vector3d& ecef_m);

}  // namespace canyon::simulation
