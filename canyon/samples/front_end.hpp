#pragma once

#include <algorithm>
#include <vector>

#include "canyon/gnss/signals.hpp"

namespace canyon::samples {

/// The receiver of samples up to its converter.
struct FrontEnd {
  double centre_hz = gnss::kL1_hz;  ///< of the band; comes out at intermediate_hz
  double intermediate_hz = 0;       ///< within the frequencies of the samples
  double rate_hz = 4e6;             ///< samples per second, [1e6, 200e6]
  bool real = false;                ///< samples of one part (Block::re), of the frequencies (0, rate_hz / 2)
  /// Two-sided, of a filter in front of the converter [Hz], within [rate_hz / 50, rate_hz / 1.1] and so that
  /// kStopLeast of it fits to either side of the intermediate frequency; 0: none, and what is beyond the
  /// band folds back.
  double bandwidth_hz = 0;
  bool noise = true;  ///< its thermal noise

  /// The frequency that comes out at 0 Hz.
  [[nodiscard]] double zero_hz() const { return centre_hz - intermediate_hz; }
  /// The band that samples can tell apart: rate_hz about zero_hz(), of real ones rate_hz / 2 above it.
  [[nodiscard]] double lowest_hz() const { return zero_hz() - (real ? 0 : rate_hz / 2); }
  [[nodiscard]] double highest_hz() const { return zero_hz() + rate_hz / 2; }
  /// From the intermediate frequency to the nearer end of the samples' frequencies.
  [[nodiscard]] double room_hz() const { return std::min(centre_hz - lowest_hz(), highest_hz() - centre_hz); }
  /// Throws InputError for a rate out of range, a centre that is not in [1e9, 2e9], an intermediate frequency
  /// at which the centre does not come out, since it is aliased, and a bandwidth that does not fit.
  void validate() const;
};

/// Whether the samples carry a signal on this carrier: at least kLeastShare of its power lies as near to it
/// as the nearer edge of the band, and of the filter's.
inline constexpr double kLeastShare = 0.7;
[[nodiscard]] bool carries(const FrontEnd& front_end, const gnss::Signal& signal, double carrier_hz);

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
