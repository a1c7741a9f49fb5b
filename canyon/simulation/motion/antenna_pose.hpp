#pragma once

#include <Eigen/Core>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::simulation {

/// Puts a vehicle on the terrain: its reference point is `height_m` above the highest sheet, and it climbs
/// with the terrain. Horizontal position and velocity do not change (in the city's frame). In an open field
/// the ground is level at the height of the city's origin. Returns false, and keeps the pose, if there is no
/// terrain. @param scene the rays of `city`
[[nodiscard]] bool clamp_to_terrain(Pose& pose, const city::City& city, const raytrace::RayScene& scene,
                                    double height_m);

/// The pose of an antenna that is mounted at `lever_arm_m` (forward, left, up) from the vehicle's reference
/// point and rotates with it. Its velocity includes the yaw rate's effect, not that of roll and pitch.
[[nodiscard]] Pose mounted_antenna(Pose vehicle, const Eigen::Vector3d& lever_arm_m);

/// Tilts the antenna's pattern with the vehicle: arrival elevations of paths (PathGeometry) are measured from
/// the vehicle's horizon. For paths that disturbances add afterwards (spoofers, bodies) the antenna is level.
/// A level pose changes nothing. @param frame the city's, in which arrivals are given
void tilt_antenna(propagation::Arrival& arrival, const Pose& pose, const geodesy::LocalFrame& frame);

}  // namespace canyon::simulation
