#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "canyon/run/motion/trajectory.hpp"

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

/// A place and a heading before they are smoothed.
struct MotionKnot {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< in any Cartesian frame [m]
  double yaw_rad = 0;                                  ///< continuous: no jumps of 2 pi
};

/// A motion whose acceleration is continuous and twice differentiable, in a Cartesian frame: stretches of
/// movement with rest between them.
///
/// Each stretch is a way through time whose mean is taken twice over kBox_s, then a B-spline with knots
/// kStep_s apart. These are means over time with weights that are not negative, so that neither speed nor
/// acceleration exceed those of the way, and the jerk is at most the largest step of its acceleration over
/// kBox_s. The path cuts a corner of acceleration a by up to kVariance_s2 a / 2. Immutable, thread-safe.
class SmoothMotion {
 public:
  static constexpr double kStep_s = 0.1;
  static constexpr int kBox = 9;  ///< steps of a mean, odd
  static constexpr double kBox_s = kBox * kStep_s;
  /// The means reach so far [s]: the motion of a stretch begins and ends this much outside of its way.
  static constexpr double kReach_s = (kBox - 1 + 3) * kStep_s;
  /// Variance of the weights: of two boxes of nine steps and a quintic spline.
  static constexpr double kVariance_s2 = (2 * (kBox * kBox - 1) / 12.0 + 0.5) * kStep_s * kStep_s;

  struct Point {
    Eigen::Vector3d position, velocity, acceleration;  ///< [m, m/s, m/s^2]
    double yaw_rad, yaw_rate_radps;
  };

  /// Adds a stretch that moves from `begin_s` on. Precondition: `begin_s` is not before end_s().
  /// @param way where it is at seconds after its own begin; asked within [-kReach_s, duration_s + kReach_s]
  /// @param duration_s of the way; the stretch lasts 2 kReach_s longer
  void add(double begin_s, double duration_s, const std::function<MotionKnot(double)>& way);

  /// End of the last stretch; 0 without any.
  [[nodiscard]] double end_s() const { return stretches_.empty() ? 0 : stretches_.back().end_s; }
  /// Before, behind and between stretches it rests. Precondition: there is a stretch.
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
/// Review 23, 1976). Within 1e-12 below 10 km of height. The point is not on the Earth's axis.
[[nodiscard]] Eigen::Matrix3d enu_from_ecef_at(const Eigen::Vector3d& ecef_m);

}  // namespace canyon::simulation
