#pragma once

namespace canyon::output {

/// The indicator of signal strength (RINEX 3.04, 5.7 and table 12): min(max(int(C/N0 / 6), 1), 9).
[[nodiscard]] int signal_strength_indicator(double cn0_dbhz);

}  // namespace canyon::output
