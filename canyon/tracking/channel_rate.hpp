#pragma once

#include <Eigen/Core>

#include "canyon/orbit/sky.hpp"
#include "canyon/propagation/paths.hpp"

namespace canyon::tracking {

/// d/dt [m/s] of geometric range plus excess path along one path, per second of true time.
///
/// The light-time equation r = |S(t - r/c) - x(t)| derived: r' = e.(V - v) / (1 + e.(V + omega x S)/c), S and
/// V turned to the axes of reception. A path over something at rest sees the antenna's velocity along the
/// direction of arrival `a` in place of e. Its excess also changes with e while the satellite moves on:
///   a plane, excess 2 h (n.e), n along e - a: 2 h n.e' = 2 excess (e - a).e' / |e - a|^2;
///   a point of an edge or a rough facade at distance d, excess d (1 - e.a): -d a.e', which is the same
/// (centimetres per second). Two planes have e' times the way from the antenna's image in both to the antenna
/// (propagation::antenna_image()). A transmitter's path has its own, of its carrier. Within 1 mm/s of
/// differences of ranges (receiver_test.cpp).
/// @param antenna_velocity_ecef [m/s], in the rotating frame; @param path in the frame that `ecef_from_enu`
/// turns
[[nodiscard]] double path_rate_mps(const orbit::LineOfSight& line,
                                   const Eigen::Vector3d& antenna_velocity_ecef,
                                   const propagation::Path& path, const Eigen::Matrix3d& ecef_from_enu);

}  // namespace canyon::tracking
