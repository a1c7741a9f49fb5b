#pragma once

#include <span>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/orbit/sky.hpp"

namespace canyon::simulation {

/// Throws InputError for the first time at which no satellite of the sky has an ephemeris.
void require_satellites(const orbit::Sky& sky, std::span<const geodesy::GpsTime> times);

}  // namespace canyon::simulation
