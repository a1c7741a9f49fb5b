#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "canyon/calibration/observed.hpp"

// Figures of one receiver's signals over a recording that a receiver's options move: what recorded and
// simulated receiver are compared by. Private to canyon/calibration.

namespace canyon::calibration {

/// In the order of moments().
enum class Moment : std::uint8_t {
  Weakest,        ///< 2 % quantile of stated C/N0 [dB-Hz]
  FirstAfterGap,  ///< lower quartile of the first C/N0 behind gaps of 3 s and more [dB-Hz]
  DelayInView,    ///< mean time from coming into clear view to the first measurement, 10 s at most [s]
  ChangeAtRest,   ///< mean change of C/N0 from epoch to epoch, clear, antenna at rest [dB]
  ScatterStrong,  ///< log of the robust deviation of changes of clear errors, 42 dB-Hz and more
  ScatterMiddle,  ///< 34 to 42 dB-Hz
  ScatterWeak,    ///< below 34 dB-Hz
  WidthClear,     ///< log of the interquartile range of clear errors
  TailClear,      ///< log of their 95 % quantile less median
  FixRoughness,   ///< log of the median second difference of horizontal fixes
  NlosLow,        ///< quartiles of C/N0 of blocked satellites less the median of clear ones [dB]
  NlosMedian,
  NlosHigh,
  NlosTracked,    ///< share of blocked satellites that are tracked
  NlosError,      ///< median error of blocked satellites [m]
  NlosErrorHigh,  ///< its upper quartile [m]
  Count
};
inline constexpr std::size_t kMoments = static_cast<std::size_t>(Moment::Count);
[[nodiscard]] std::string_view name(Moment moment);
using Moments = std::array<std::optional<double>, kMoments>;

/// Horizontal errors of fixes in a row [m], NaN where there is none.
using FixErrors = std::vector<Eigen::Vector2d>;

/// Empty where there are too few observations. @param weights by epoch, how often each counts (blocks drawn
/// with replacement); empty: once @param step_db that C/N0 are stated in, over which equal ones are spread
[[nodiscard]] Moments moments(const Observed& observed, const FixErrors& fixes, double step_db,
                              std::span<const std::uint16_t> weights = {});

}  // namespace canyon::calibration
