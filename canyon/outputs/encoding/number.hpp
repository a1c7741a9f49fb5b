#pragma once

#include <string>

#include "canyon/base/geodesy/gps_time.hpp"

namespace canyon::encoding {

/// `value` with `decimals` digits after the point, always in the C locale; "" if it is not finite (the files'
/// mark for "not known"), never "-0.0".
[[nodiscard]] std::string fixed(double value, int decimals);
/// Appends it to `text`.
void append_fixed(std::string& text, double value, int decimals);

/// Seconds of the GPS week, exact to the nanosecond: at least `min_decimals` (0 to 9) digits after the point,
/// more if the instant needs them.
[[nodiscard]] std::string seconds_of_week(geodesy::GpsTime t, int min_decimals = 3);

}  // namespace canyon::encoding
