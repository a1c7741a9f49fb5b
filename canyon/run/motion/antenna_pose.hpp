#pragma once

#include <Eigen/Core>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/run/motion/trajectory.hpp"

namespace canyon::simulation {

/// Puts a vehicle on the terrain: its reference point lies `height_m` above the highest sheet, and it climbs
/// as the terrain does. Horizontal place and velocity stay (in the city's frame). In an open field the ground
/// is level at the height of the city's origin. Returns false, and keeps the pose, where there is no terrain.
/// @param scene the rays of `city`
[[nodiscard]] bool clamp_to_terrain(Pose& pose, const city::City& city, const raytrace::RayScene& scene,
                                    double height_m);

/// The pose of an antenna that is mounted at `lever_arm_m` (forward, left, up) from the vehicle's reference
/// point and turns with it. Its velocity has the yaw rate's part; roll and pitch count as slow.
[[nodiscard]] Pose mounted_antenna(Pose vehicle, const Eigen::Vector3d& lever_arm_m);

/// Turns the antenna's pattern with a tilted vehicle: elevations at which paths come in (PathGeometry) are
/// counted from the vehicle's own horizon. Paths that disturbances add afterwards (spoofers, bodies) meet a
/// level antenna. A level pose changes nothing. @param frame the city's, in which arrivals are given
void tilt_antenna(propagation::Arrival& arrival, const Pose& pose, const geodesy::LocalFrame& frame);

}  // namespace canyon::simulation
