#pragma once

#include <Eigen/Core>

#include "canyon/base/geodesy/gps_time.hpp"

namespace canyon::geodesy {

/// The Earth's magnetic field by the World Magnetic Model 2025: degree 12, with a constant rate of change.
/// Without the fields of crust, magnetosphere and objects, some 150 nT in the open.
/// @param ecef_m from the Earth's surface to some 1000 km above it
/// @param t if magnetic_model_is_valid() is false, the error grows: compared with the models of those years
/// it is 34 nT (rms over the globe) in 2021, 93 nT in 2019.3 and 300 nT in 2012
/// @return [T] in ECEF axes
[[nodiscard]] Eigen::Vector3d magnetic_field_tesla(const Eigen::Vector3d& ecef_m, GpsTime t);

/// Whether the model covers this instant: 2025.0 to 2030.0.
[[nodiscard]] bool magnetic_model_is_valid(GpsTime t);

}  // namespace canyon::geodesy
