#pragma once

#include <string>

#include "canyon/base/geodesy/gps_time.hpp"

namespace canyon::output {

/// `value` with `decimals` digits behind the point, in the C locale whatever the program's; "" where it is
/// not finite (the files' mark for "not known"), never "-0.0".
[[nodiscard]] std::string fixed(double value, int decimals);
/// The same behind `text`.
void append_fixed(std::string& text, double value, int decimals);

/// Seconds of the GPS week, exact to the nanosecond: at least `min_decimals` (0 to 9) digits behind the
/// point, more where the instant needs them.
[[nodiscard]] std::string seconds_of_week(geodesy::GpsTime t, int min_decimals = 3);

}  // namespace canyon::output
