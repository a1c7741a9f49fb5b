#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <optional>

#include "canyon/run/motion/pose.hpp"
#include "canyon/run/motion/pose_motion.hpp"

namespace canyon::simulation {

/// A smooth motion through poses that arrive one by one, for sensors that feel accelerations: quintic
/// B-splines (UniformSpline) through the poses at even steps, known up to three steps before the last one.
/// The path is a mean of poses with the variance step^2 / 2: in a bend it lies a step^2 / 4 inside, with the
/// acceleration a; jumps and noise of poses become pushes over some steps.
class SmoothPoses {
 public:
  /// @param frame of the poses; must outlive this
  /// @param step_s above 0; poses should come at least as often
  SmoothPoses(const geodesy::LocalFrame& frame, double step_s);

  [[nodiscard]] double step_s() const { return step_s_; }
  /// The instant up to which poses are needed for the motion at `at_ns` and 10 ms behind it.
  [[nodiscard]] std::int64_t needs_ns(std::int64_t at_ns) const;
  /// Takes the poses of the track up to the last one. Call it for each that comes, at `now_ns`. A pause in
  /// them, longer than the track bridges, ends the motion; it begins anew behind it.
  void follow(PoseTrack& track, std::int64_t now_ns);
  /// Takes what the motion at `at_ns` needs beyond the poses that have come: as the track moves them on.
  void reach(PoseTrack& track, std::int64_t at_ns);
  /// The longest time between two poses lately, where it is longer than the step [s].
  [[nodiscard]] std::optional<double> sparse_s() const;

  /// Whether the motion at `at_ns` is known.
  [[nodiscard]] bool holds(std::int64_t at_ns) const;
  /// Its first instant since the last pause [s]. Precondition: it holds at some instant.
  [[nodiscard]] double begin_s() const { return static_cast<double>(first_ + kAhead) * step_s_; }
  /// The body in the frame of the poses. Where the motion is not known it rests at its end.
  [[nodiscard]] RigidPose at(double t_s) const;
  /// The same as the motion of a rigid body in ECEF, and as a pose at `time`.
  [[nodiscard]] EcefPose ecef_at(double t_s) const;
  [[nodiscard]] Pose pose_at(double t_s, geodesy::GpsTime time) const;

 private:
  struct Derivatives {
    RigidPose body;
    Eigen::Vector3d acceleration;
  };
  /// Points before the first one: it moves there as between the first two.
  static constexpr std::int64_t kAhead = 3;
  void add(const RigidPose& body);
  void forget();
  [[nodiscard]] Derivatives derivatives_at(double t_s) const;
  [[nodiscard]] std::int64_t next() const { return first_ + static_cast<std::int64_t>(points_.size()); }

  const geodesy::LocalFrame& frame_;
  double step_s_;
  std::int64_t step_ns_;
  std::deque<RigidPose> points_;  // their quaternions lie on one half of the sphere, each to the one before
  std::int64_t first_ = 0;        // points_[0] stands at first_ step_s_
  std::optional<std::int64_t> came_ns_;
  double longest_s_ = 0;
};

}  // namespace canyon::simulation
