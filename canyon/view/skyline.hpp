#pragma once

#include <Eigen/Core>
#include <string>

#include "canyon/output/view_chunk.hpp"
#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::view {

/// A row of the table "skylines" at a place in the city's frame [m, east north up]: output::kSkylineSectors
/// bytes from north clockwise, half degrees of the highest hidden elevation.
[[nodiscard]] std::string skyline_bytes(const raytrace::RayScene& scene, const Eigen::Vector3d& antenna_enu);

/// The skyline of an antenna that moves.
class MovingSkyline {
 public:
  /// @param step_m where the antenna has moved by less, the last skyline stays [m]; >= 0
  explicit MovingSkyline(double step_m = 3) : step_m_(step_m) {}

  /// Goes to a place of the city's frame; true where the skyline is a new one.
  bool move(const raytrace::RayScene& scene, const Eigen::Vector3d& antenna_enu);
  /// As skyline_bytes(); empty before the first move().
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  double step_m_;
  Eigen::Vector3d place_ = Eigen::Vector3d::Zero();
  std::string bytes_;
};

/// The table "skylines" of a drive: one row for each place where the antenna has moved far enough.
class Skylines {
 public:
  /// @param step_m as MovingSkyline's
  explicit Skylines(double step_m) : skyline_(step_m) {}

  /// Row of the skyline at a place of the city's frame: the last one, or a new one.
  int row_at(const raytrace::RayScene& scene, const Eigen::Vector3d& antenna_enu);
  [[nodiscard]] const output::ViewRows& rows() const { return rows_; }

 private:
  MovingSkyline skyline_;
  output::ViewRows rows_{output::kViewSkylines};
};

}  // namespace canyon::view
