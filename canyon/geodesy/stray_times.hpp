#pragma once

#include <vector>

#include "canyon/geodesy/gps_time.hpp"

namespace canyon::geodesy {

/// Marks the times of a recording, in its order, that contradict the others: the fewest without which the
/// rest rises (outside_longest_rise()), and groups of up to three that stand an hour or more from all others,
/// which are a hundred times as many, or a day from five times as many.
[[nodiscard]] std::vector<bool> stray_times(const std::vector<GpsTime>& times);

}  // namespace canyon::geodesy
