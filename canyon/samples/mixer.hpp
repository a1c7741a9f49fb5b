#pragma once

#include <cstdint>
#include <vector>

#include "canyon/base/random.hpp"

// The loops over samples. A block is split in real and imaginary parts, padded to a multiple of kLanes.

namespace canyon::samples {

/// Samples that are made together.
inline constexpr std::size_t kLanes = 16;
/// Largest step of a code [slots per sample].
inline constexpr double kMostSlots = 15;

/// Baseband samples of a block, in units of the thermal noise: 1 is its standard deviation in each part.
struct Block {
  std::vector<float> re, im;
  /// All 0. @param samples padded to a multiple of kLanes
  void clear(std::size_t samples);
};

/// A satellite's signal during a block, one value a slot (a part of a chip). `im` is empty where it is real.
struct Slots {
  std::vector<float> re, im;
};

/// A path over one block: oscillators of code and carrier, each linear in the sample.
struct PathBlock {
  double slot = 0, slots_per_sample = 0;     ///< position in Slots at the first sample, >= 0; [0, kMostSlots]
  double cycles = 0, cycles_per_sample = 0;  ///< carrier phase at the first sample
  double amplitude = 0;
};

/// Adds a path. The code's oscillator counts 2^-32 slots (its rate is off by up to 2^-33 slots a sample), the
/// carrier's is a complex product every kLanes samples in single precision: 1e-5 rad after 4,000 samples.
/// `slots` must reach kLanes samples beyond the block.
void add_path(const Slots& slots, const PathBlock& path, Block& block);

/// Adds a complex exponential.
void add_tone(double cycles, double cycles_per_sample, double amplitude, Block& block);

/// Multiplies by a complex exponential.
void turn(double cycles, double cycles_per_sample, Block& block);

/// out[n], n < samples: the sum of taps[k] in[step n + k]. @param taps their number is a multiple of kLanes
void decimate(const float* in, const std::vector<float>& taps, std::size_t step, std::size_t samples,
              float* out);

/// A stream of a key; neighbours have nothing in common.
[[nodiscard]] RandomStream keyed_stream(std::uint64_t key);

/// Adds white noise of standard deviation 1 in each part: the sum of two table values of 12 bits each, up to
/// 4.9, kurtosis 3 within 0.01. @param key alike: the same noise
void add_noise(std::uint64_t key, Block& block);

/// Interleaved samples times `gain`: to the nearest integer, at most +-the largest one; floats as they are.
/// @param out std::int8_t, std::int16_t or float
template <typename Value>
void quantise(const Block& block, std::size_t samples, float gain, Value* out);
/// The same of one part.
template <typename Value>
void quantise(const float* part, std::size_t samples, float gain, Value* out);
/// Mean square of the first samples of a part, summed in one order on every machine.
[[nodiscard]] double power(const float* part, std::size_t samples);

}  // namespace canyon::samples
