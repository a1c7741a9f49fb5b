#pragma once

#include <vector>

namespace canyon::samples {

/// Samples are made so many times as fast where a filter stands in front of the converter.
inline constexpr int kOversampling = 4;
/// Frequencies that the filter passes reach to half of the bandwidth, those that it stops begin at this part
/// of it, or sooner where the band of the samples ends there, but not below kStopLeast of it.
inline constexpr double kStop = 0.75, kStopLeast = 0.55;

/// Taps of a linear-phase low-pass filter: the ideal one's response within a window (J. F. Kaiser, IEEE ISCAS
/// 1974), odd in number, alike from both ends, of energy 1, so that white noise keeps its power. To
/// `pass_hz` it is flat within 0.02 dB, from `stop_hz` on 60 dB down (tests).
/// Precondition: 0 < pass_hz < stop_hz < rate_hz / 2
[[nodiscard]] std::vector<float> low_pass(double rate_hz, double pass_hz, double stop_hz);

}  // namespace canyon::samples
