#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <complex>
#include <optional>

#include "canyon/paths/propagation/index/knife_edge.hpp"

// Closed forms for comparison with rays around edges.

namespace canyon::propagation::test {

/// J(nu) [dB] = -20 log10 |knife_edge_field(nu)|, exact (P.526-15, 4.1). Negative where the edge's wave adds
/// to the direct one (-1.37 dB at nu = -1.217 is the lowest).
inline double exact_knife_edge_loss_db(double nu) {
  return -20 * std::log10(std::abs(knife_edge_field(nu)));
}

/// A ray from a satellite (infinitely far) diffracted at an edge to the antenna.
struct EdgeRay {
  Eigen::Vector3d point;    ///< on the edge
  Eigen::Vector3d arrival;  ///< unit, from the antenna to `point`
  double excess_m = 0;      ///< path length minus the straight line
  double bend_rad = 0;      ///< angle between the straight line and `arrival`
};

/// The stationary path around a straight edge (Keller's cone: the ray makes the same angle with the edge
/// before and after). With rho the antenna's distance to the edge's line, s the unit direction to the
/// satellite, s_perp its part perpendicular to the edge and e the unit vector to the nearest point of the
/// line: excess = rho (|s_perp| - e.s), exact; relative error 1e-12 of rho. The caller checks whether the
/// edge blocks or is visible.
/// @param antenna, start, end any one frame, [m], finite
/// @param satellite unit, from the antenna
/// @return empty if the stationary point is outside start..end, the edge has no length, the antenna lies
/// on its line or the satellite in the direction of the edge (within 1e-9)
inline std::optional<EdgeRay> ray_around_edge(const Eigen::Vector3d& antenna,
                                              const Eigen::Vector3d& satellite, const Eigen::Vector3d& start,
                                              const Eigen::Vector3d& end) {
  constexpr double kNothing = 1e-9;
  const double length = (end - start).norm();
  if (!(length > kNothing)) return std::nullopt;
  const Eigen::Vector3d tangent = (end - start) / length;
  const double foot_at = (antenna - start).dot(tangent);
  const Eigen::Vector3d to_foot = start + foot_at * tangent - antenna;
  const double rho = to_foot.norm();
  const double along = satellite.dot(tangent);
  const double across = satellite.cross(tangent).norm();  // not sqrt(1 - along^2), which cancels
  if (!(rho > kNothing) || !(across > kNothing)) return std::nullopt;
  // d/dz (sqrt(rho^2 + z^2) - z along) = 0
  const double at = foot_at + rho * along / across;
  if (!(at >= 0 && at <= length)) return std::nullopt;
  EdgeRay ray;
  ray.point = start + at * tangent;
  ray.arrival = (ray.point - antenna).normalized();
  ray.bend_rad = std::atan2(ray.arrival.cross(satellite).norm(), ray.arrival.dot(satellite));
  // rho (across - e.s) = rho across (1 - cos phi), phi about the edge's axis; 2 sin^2(phi/2) keeps the digits
  // of small bends.
  const Eigen::Vector3d e = to_foot / rho, s = (satellite - along * tangent) / across;
  const double half_chord = (e - s).norm() / 2;
  ray.excess_m = 2 * rho * across * half_chord * half_chord;
  return ray;
}

}  // namespace canyon::propagation::test
