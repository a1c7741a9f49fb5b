#pragma once

#include <string>

#include "canyon/geodesy/frames.hpp"

namespace canyon::geodesy {

/// The south-west corner of a square of 100 km of the Military Grid Reference System: "54SUE", without
/// blanks, in either case. Throws InputError for a text that does not name one, and for the polar squares,
/// which have no zone. GeographicLib::MGRS.
[[nodiscard]] Utm utm_of_mgrs_square(const std::string& square);

}  // namespace canyon::geodesy
