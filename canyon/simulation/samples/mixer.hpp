#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "canyon/base/random.hpp"
#include "canyon/sky/gnss/signals.hpp"

// The loops over samples. A block has separate real and imaginary parts, padded to a multiple of kLanes.

namespace canyon::samples {

/// Samples that are computed together.
inline constexpr std::size_t kLanes = 16;
/// Largest step of a code [slots per sample].
inline constexpr double kMaxSlots = 15;

/// Baseband samples of a block, in units of the thermal noise: 1 is its standard deviation in each part.
struct SampleBlock {
  std::vector<float> re, im;
  /// All 0. @param samples padded to a multiple of kLanes
  void clear(std::size_t samples);
};

/// A satellite's signal during a block, one value per slot (a part of a chip). `im` is empty if it is real.
struct Slots {
  std::vector<float> re, im;
};

/// A path over one block: oscillators of code and carrier, each linear in the sample.
struct PathBlock {
  double slot = 0, slots_per_sample = 0;     ///< position in Slots at the first sample, >= 0; [0, kMaxSlots]
  double cycles = 0, cycles_per_sample = 0;  ///< carrier phase at the first sample
  double amplitude = 0;
};

/// Adds a path. The code's oscillator counts 2^-32 slots (its rate error is up to 2^-33 slots a sample); the
/// carrier's is a complex product every kLanes samples in single precision: 1e-5 rad error after 4,000
/// samples. `slots` must extend kLanes samples beyond the block.
void add_path(const Slots& slots, const PathBlock& path, SampleBlock& block);

void add_tone(double cycles, double cycles_per_sample, double amplitude, SampleBlock& block);

/// Multiplies by a complex exponential.
void rotate_phase(double cycles, double cycles_per_sample, SampleBlock& block);

/// out[n], n < samples: the sum of taps[k] in[step n + k]. @param taps their number is a multiple of kLanes
void decimate(const float* in, const std::vector<float>& taps, std::size_t step, std::size_t samples,
              float* out);

/// The random stream of a key; neighbouring keys have independent streams.
[[nodiscard]] RandomStream keyed_stream(std::uint64_t key);

/// Adds white noise of standard deviation 1 in each part: the sum of two table values of 12 bits each, up
/// to 4.9, kurtosis 3 within 0.01. @param key equal keys give equal noise
void add_noise(std::uint64_t key, SampleBlock& block);

/// Interleaved samples times `gain`: to the nearest integer, limited to +-the largest one; floats are not
/// rounded.
/// @param out std::int8_t, std::int16_t or float
template <typename Value>
void quantise(const SampleBlock& block, std::size_t samples, float gain, Value* out);
/// The same for one part.
template <typename Value>
void quantise(const float* part, std::size_t samples, float gain, Value* out);

/// The front end of a receiver, up to its converter.
struct FrontEnd {
  double centre_hz = gnss::kL1_hz;  ///< of the band; output at intermediate_hz
  double intermediate_hz = 0;       ///< within the frequencies of the samples
  double rate_hz = 4e6;             ///< samples per second, [1e6, 200e6]
  bool real = false;  ///< samples of one part (SampleBlock::re), of the frequencies (0, rate_hz / 2)
  /// Two-sided bandwidth of a filter before the converter [Hz], within [rate_hz / 50, rate_hz / 1.1];
  /// kStopLeast of it must fit on either side of the intermediate frequency. 0: none; outside the band is
  /// aliased.
  double bandwidth_hz = 0;
  bool noise = true;  ///< its thermal noise

  /// The frequency that is converted to 0 Hz.
  [[nodiscard]] double zero_hz() const { return centre_hz - intermediate_hz; }
  /// The unambiguous band of the samples: rate_hz about zero_hz(); for real samples rate_hz / 2 above it.
  [[nodiscard]] double lowest_hz() const { return zero_hz() - (real ? 0 : rate_hz / 2); }
  [[nodiscard]] double highest_hz() const { return zero_hz() + rate_hz / 2; }
  /// Distance of the intermediate frequency from the nearer end of the samples' frequencies.
  [[nodiscard]] double room_hz() const { return std::min(centre_hz - lowest_hz(), highest_hz() - centre_hz); }
  /// Throws InputError for a rate out of range, a centre that is not in [1e9, 2e9], an intermediate frequency
  /// to which the centre cannot be converted because of aliasing, and a bandwidth that does not fit.
  void validate() const;
};

/// Whether the samples contain a signal on this carrier: at least kMinFraction of its power is as near to it
/// as the nearer edge of the band, and of the filter's.
inline constexpr double kMinFraction = 0.7;
[[nodiscard]] bool carries(const FrontEnd& front_end, const gnss::Signal& signal, double carrier_hz);

/// Oversampling factor if there is a filter before the converter.
inline constexpr int kOversampling = 4;
/// The filter passes frequencies up to half of the bandwidth. Its stop band begins at kStop times the
/// bandwidth, or sooner if the band of the samples ends there, but not below kStopLeast times the bandwidth.
inline constexpr double kStop = 0.75, kStopLeast = 0.55;

/// Taps of a linear-phase low-pass filter: the ideal one's response within a window (J. F. Kaiser, IEEE ISCAS
/// 1974), odd in number, symmetric, of energy 1, so that white noise keeps its power. It is flat within 0.02
/// dB up to `pass_hz`, and 60 dB down from `stop_hz` on (tests). Precondition: 0 < pass_hz < stop_hz <
/// rate_hz / 2
[[nodiscard]] std::vector<float> low_pass(double rate_hz, double pass_hz, double stop_hz);

}  // namespace canyon::samples
