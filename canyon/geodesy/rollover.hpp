#pragma once

#include <string>

#include "canyon/geodesy/gps_time.hpp"

namespace canyon::geodesy {

/// "; 1024 weeks later it would be near: ..." where `stated` and `expected` are whole rollovers of the GPS
/// week apart, but for 8 days: old receivers state such dates. Empty elsewhere.
[[nodiscard]] std::string rollover_text(GpsTime stated, GpsTime expected);

}  // namespace canyon::geodesy
