#pragma once

#include <Eigen/Core>

namespace canyon::geodesy {

/// Normal gravity of WGS 84 [m/s^2, ECEF], with the centrifugal acceleration, at any point outside of the
/// Earth's core: the closed form of Somigliana and Pizzetti for the level ellipsoid (Heiskanen and Moritz,
/// Physical Geodesy, 2-8), by GeographicLib. @param ecef [m]
[[nodiscard]] Eigen::Vector3d normal_gravity(const Eigen::Vector3d& ecef);

}  // namespace canyon::geodesy
