#pragma once

#include <string_view>

#include "canyon/geodesy/gps_time.hpp"

/// Times as people write them for a simulation.
namespace canyon::geodesy {

/// Whether a text that parse_time() reads says which clock it shows: Z, UTC, GPST or an offset from UTC. A
/// time without any of them is taken as UTC, although it may be meant as local time.
[[nodiscard]] bool names_time_scale(std::string_view text);

/// parse_time() of an instant that can be simulated, recorded and written to files: GPS weeks 0 to 9999,
/// 1980-01-06 to 2171-08-31. Throws InputError for any other, and as parse_time() does.
[[nodiscard]] GpsTime parse_simulated_time(std::string_view text);

}  // namespace canyon::geodesy
