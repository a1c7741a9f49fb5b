#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "canyon/geodesy/gps_time.hpp"

namespace canyon::disturbance {

/// The way of an antenna's vehicle through a city [m, east and north]: the lane that it drives in, straight
/// on beyond both ends. Filled once from a trajectory, or as a host drives; const calls are thread-safe.
class Road {
 public:
  /// A place on it.
  struct Point {
    Eigen::Vector2d place;
    Eigen::Vector2d ahead;  ///< unit: its direction, over 10 m
  };

  /// The vehicle's place at a time; times that are not later than the last one change nothing.
  void add(geodesy::GpsTime time, const Eigen::Vector2d& place);
  /// Sets the vehicle's direction (unit), which is the road's while it has not moved.
  void face(const Eigen::Vector2d& ahead) { facing_ = ahead; }
  void clear();

  /// The vehicle has gone far enough to say where the road leads.
  [[nodiscard]] bool leads() const { return vertices_.size() > 1; }
  [[nodiscard]] const std::optional<Eigen::Vector2d>& facing() const { return facing_; }
  /// Way [m] up to a time, linear between those that were added, held beyond.
  [[nodiscard]] double along_m(geodesy::GpsTime time) const;
  /// Precondition: leads().
  [[nodiscard]] Point at(double along_m) const;

 private:
  struct Vertex {
    double along_m;
    Eigen::Vector2d place;
  };
  struct Knot {
    geodesy::GpsTime time;
    double along_m;
  };
  [[nodiscard]] Eigen::Vector2d place(double along_m) const;

  std::vector<Vertex> vertices_;  // at least kStep_m apart
  std::vector<Knot> knots_;
  std::optional<Eigen::Vector2d> facing_;
};

}  // namespace canyon::disturbance
