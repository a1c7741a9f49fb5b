#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <optional>

#include "canyon/simulation/motion/pose.hpp"
#include "canyon/simulation/motion/pose_motion.hpp"

namespace canyon::simulation {

/// A smooth motion through poses that arrive one by one, for sensors that measure accelerations: quintic
/// B-splines (UniformSpline) through the poses at even steps, known up to three steps before the last one.
/// The path is a weighted mean of poses with the variance step^2 / 2: with acceleration a, it is a step^2 / 4
/// inside a bend. Jumps and noise of poses become accelerations over several steps.
class SmoothPoses {
 public:
  /// @param frame of the poses; must outlive this
  /// @param step_s above 0; poses should arrive at least as often
  SmoothPoses(const geodesy::LocalFrame& frame, double step_s);

  [[nodiscard]] double step_s() const { return step_s_; }
  /// The instant up to which poses are needed for the motion at `at_ns` and up to 10 ms later.
  [[nodiscard]] std::int64_t needs_ns(std::int64_t at_ns) const;
  /// Adds the poses of the track up to the last one. Call it for each pose that arrives, at `now_ns`. A pause
  /// that is longer than the track bridges ends the motion; it restarts after the pause.
  void follow(PoseTrack& track, std::int64_t now_ns);
  /// Adds the poses that the motion at `at_ns` still needs, extrapolated by the track.
  void reach(PoseTrack& track, std::int64_t at_ns);
  /// The longest time between two recent poses [s], if it is longer than the step.
  [[nodiscard]] std::optional<double> sparse_s() const;

  /// Whether the motion at `at_ns` is known.
  [[nodiscard]] bool holds(std::int64_t at_ns) const;
  /// Its first instant since the last pause [s]. Precondition: it holds at some instant.
  [[nodiscard]] double begin_s() const { return static_cast<double>(first_ + kAhead) * step_s_; }
  /// The body in the frame of the poses. Outside the known motion it rests at the nearer end.
  [[nodiscard]] RigidPose at(double t_s) const;
  /// at() as the motion of a rigid body in ECEF, and as a pose at `time`.
  [[nodiscard]] EcefPose ecef_at(double t_s) const;
  [[nodiscard]] Pose pose_at(double t_s, geodesy::GpsTime time) const;

 private:
  struct Derivatives {
    RigidPose body;
    Eigen::Vector3d acceleration;
  };
  /// Points before the first one, extrapolated from the first two.
  static constexpr std::int64_t kAhead = 3;
  void add(const RigidPose& body);
  void forget();
  [[nodiscard]] Derivatives derivatives_at(double t_s) const;
  [[nodiscard]] std::int64_t next() const { return first_ + static_cast<std::int64_t>(points_.size()); }

  const geodesy::LocalFrame& frame_;
  double step_s_;
  std::int64_t step_ns_;
  std::deque<RigidPose> points_;  // each quaternion is in the hemisphere of the one before
  std::int64_t first_ = 0;        // index of points_[0]: its time is first_ step_s_
  std::optional<std::int64_t> came_ns_;
  double longest_s_ = 0;
};

}  // namespace canyon::simulation
