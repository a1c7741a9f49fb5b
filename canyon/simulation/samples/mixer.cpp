#include "canyon/simulation/samples/mixer.hpp"

#include <fmt/format.h>

#include <array>
#include <cassert>
#include <cmath>
#include <complex>
#include <limits>

#include "canyon/base/arithmetic.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/receiver/tracking/loop_noise.hpp"

namespace canyon::samples {
namespace {

constexpr double kRadians = 2 * geodesy::kPi;

/// kLanes samples of a carrier, and the factor that rotates them to the next ones.
struct Carrier {
  alignas(64) std::array<float, kLanes> re, im;
  float rotation_re, rotation_im;

  Carrier(double cycles, double cycles_per_sample, double amplitude) {
    const std::complex<double> step = std::polar(1.0, kRadians * std::remainder(cycles_per_sample, 1));
    std::complex<double> value = std::polar(amplitude, kRadians * std::remainder(cycles, 1));
    for (std::size_t l = 0; l < kLanes; ++l) {
      re[l] = static_cast<float>(value.real());
      im[l] = static_cast<float>(value.imag());
      value *= step;
    }
    const double lanes = static_cast<double>(kLanes) * std::remainder(cycles_per_sample, 1);
    const std::complex<double> rotation = std::polar(1.0, kRadians * std::remainder(lanes, 1));
    rotation_re = static_cast<float>(rotation.real());
    rotation_im = static_cast<float>(rotation.imag());
  }
};

CANYON_CLONES void mix_real(const float* __restrict slots, std::uint64_t position, std::uint64_t step,
                            const Carrier& begin, std::size_t samples, float* __restrict re,
                            float* __restrict im) {
  Carrier carrier = begin;
  alignas(64) std::array<std::int32_t, kLanes> ahead;
  for (std::size_t l = 0; l < kLanes; ++l) ahead[l] = static_cast<std::int32_t>((step * l) >> 9U);
  for (std::size_t n = 0; n < samples; n += kLanes) {
    const float* from = slots + (position >> 32U);
    const auto fraction = static_cast<std::int32_t>((position & 0xFFFFFFFFU) >> 9U);
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float value = from[(fraction + ahead[l]) >> 23];
      const float c = carrier.re[l], s = carrier.im[l];
      re[n + l] += value * c;
      im[n + l] += value * s;
      carrier.re[l] = c * carrier.rotation_re - s * carrier.rotation_im;
      carrier.im[l] = c * carrier.rotation_im + s * carrier.rotation_re;
    }
    position += step * kLanes;
  }
}

CANYON_CLONES void mix_complex(const float* __restrict slots_re, const float* __restrict slots_im,
                               std::uint64_t position, std::uint64_t step, const Carrier& begin,
                               std::size_t samples, float* __restrict re, float* __restrict im) {
  Carrier carrier = begin;
  alignas(64) std::array<std::int32_t, kLanes> ahead;
  for (std::size_t l = 0; l < kLanes; ++l) ahead[l] = static_cast<std::int32_t>((step * l) >> 9U);
  for (std::size_t n = 0; n < samples; n += kLanes) {
    const float* from_re = slots_re + (position >> 32U);
    const float* from_im = slots_im + (position >> 32U);
    const auto fraction = static_cast<std::int32_t>((position & 0xFFFFFFFFU) >> 9U);
    for (std::size_t l = 0; l < kLanes; ++l) {
      const std::int32_t at = (fraction + ahead[l]) >> 23;
      const float x = from_re[at], y = from_im[at];
      const float c = carrier.re[l], s = carrier.im[l];
      re[n + l] += x * c - y * s;
      im[n + l] += x * s + y * c;
      carrier.re[l] = c * carrier.rotation_re - s * carrier.rotation_im;
      carrier.im[l] = c * carrier.rotation_im + s * carrier.rotation_re;
    }
    position += step * kLanes;
  }
}

CANYON_CLONES void rotate_by(const Carrier& begin, std::size_t samples, float* __restrict re,
                             float* __restrict im) {
  Carrier carrier = begin;
  for (std::size_t n = 0; n < samples; n += kLanes) {
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float x = re[n + l], y = im[n + l];
      const float c = carrier.re[l], s = carrier.im[l];
      re[n + l] = x * c - y * s;
      im[n + l] = x * s + y * c;
      carrier.re[l] = c * carrier.rotation_re - s * carrier.rotation_im;
      carrier.im[l] = c * carrier.rotation_im + s * carrier.rotation_re;
    }
  }
}

CANYON_CLONES void decimate_by(const float* __restrict in, const float* __restrict taps, std::size_t count,
                               std::size_t step, std::size_t samples, float* __restrict out) {
  for (std::size_t n = 0; n < samples; ++n) {
    const float* from = in + step * n;
    alignas(64) std::array<float, kLanes> sums{};
    for (std::size_t k = 0; k < count; k += kLanes)
      for (std::size_t l = 0; l < kLanes; ++l) sums[l] += taps[k + l] * from[k + l];
    for (std::size_t width = kLanes / 2; width > 0; width /= 2)
      for (std::size_t l = 0; l < width; ++l) sums[l] += sums[l + width];
    out[n] = sums[0];
  }
}

constexpr std::size_t kNoiseBits = 12, kNoiseSteps = std::size_t{1} << kNoiseBits;

/// Values at equal steps of the normal distribution, of variance 1/2.
std::array<float, kNoiseSteps> noise_table() {
  std::array<double, kNoiseSteps> values{};
  double power = 0;
  for (std::size_t i = 0; i < kNoiseSteps / 2; ++i) {
    // The value with an upper tail of (i + 1/2) / steps, by bisection.
    const double tail = (static_cast<double>(i) + 0.5) / kNoiseSteps;
    double low = 0, high = 8;
    for (int k = 0; k < 50; ++k) {
      const double middle = (low + high) / 2;
      (std::erfc(middle / std::sqrt(2.0)) / 2 > tail ? low : high) = middle;
    }
    values[i] = low;
    values[kNoiseSteps - 1 - i] = -low;
    power += 2 * low * low;
  }
  const double scale = std::sqrt(0.5 * kNoiseSteps / power);
  std::array<float, kNoiseSteps> table{};
  for (std::size_t i = 0; i < kNoiseSteps; ++i) table[i] = static_cast<float>(values[i] * scale);
  return table;
}

template <typename Integer>
Integer nearest(float scaled) {
  constexpr float kMax = std::numeric_limits<Integer>::max();
  const float low = scaled < -kMax ? -kMax : scaled;
  const float within = low > kMax ? kMax : low;
  return static_cast<Integer>(static_cast<int>(within + std::copysign(0.5F, within)));
}
template <>
float nearest<float>(float scaled) {
  return scaled;
}

}  // namespace

void SampleBlock::clear(std::size_t samples) {
  const std::size_t padded = (samples + kLanes - 1) / kLanes * kLanes;
  re.assign(padded, 0);
  im.assign(padded, 0);
}

void add_path(const Slots& slots, const PathBlock& path, SampleBlock& block) {
  assert(path.slot >= 0 && path.slots_per_sample >= 0 && path.slots_per_sample <= kMaxSlots);
  const auto position = static_cast<std::uint64_t>(std::ldexp(path.slot, 32));
  const auto step = static_cast<std::uint64_t>(std::llround(std::ldexp(path.slots_per_sample, 32)));
  assert((position + step * block.re.size()) >> 32U < slots.re.size());
  const Carrier carrier(path.cycles, path.cycles_per_sample, path.amplitude);
  if (slots.im.empty()) {
    mix_real(slots.re.data(), position, step, carrier, block.re.size(), block.re.data(), block.im.data());
  } else {
    mix_complex(slots.re.data(), slots.im.data(), position, step, carrier, block.re.size(), block.re.data(),
                block.im.data());
  }
}

void add_tone(double cycles, double cycles_per_sample, double amplitude, SampleBlock& block) {
  static const Slots one{{1, 1}, {}};
  PathBlock path;
  path.cycles = cycles;
  path.cycles_per_sample = cycles_per_sample;
  path.amplitude = amplitude;
  add_path(one, path, block);
}

void rotate_phase(double cycles, double cycles_per_sample, SampleBlock& block) {
  rotate_by(Carrier(cycles, cycles_per_sample, 1), block.re.size(), block.re.data(), block.im.data());
}

void decimate(const float* in, const std::vector<float>& taps, std::size_t step, std::size_t samples,
              float* out) {
  assert(taps.size() % kLanes == 0);
  decimate_by(in, taps.data(), taps.size(), step, samples, out);
}

RandomStream keyed_stream(std::uint64_t key) {
  return RandomStream::from_state(
      {mix64(key), mix64(key + kGolden64), mix64(key + 2 * kGolden64), mix64(key + 3 * kGolden64) | 1U});
}

void add_noise(std::uint64_t key, SampleBlock& block) {
  static const std::array<float, kNoiseSteps> table = noise_table();
  RandomStream stream = keyed_stream(key);
  constexpr std::uint64_t kMask = kNoiseSteps - 1;
  for (std::size_t n = 0; n < block.re.size(); ++n) {
    const std::uint64_t bits = stream.next();
    block.re[n] += table[bits & kMask] + table[(bits >> 12U) & kMask];
    block.im[n] += table[(bits >> 24U) & kMask] + table[(bits >> 36U) & kMask];
  }
}

template <typename Value>
void quantise(const SampleBlock& block, std::size_t samples, float gain, Value* out) {
  const float* __restrict re = block.re.data();
  const float* __restrict im = block.im.data();
  for (std::size_t n = 0; n < samples; ++n) {
    out[2 * n] = nearest<Value>(re[n] * gain);
    out[2 * n + 1] = nearest<Value>(im[n] * gain);
  }
}
template <typename Value>
void quantise(const float* part, std::size_t samples, float gain, Value* out) {
  for (std::size_t n = 0; n < samples; ++n) out[n] = nearest<Value>(part[n] * gain);
}
template void quantise(const SampleBlock&, std::size_t, float, std::int8_t*);
template void quantise(const SampleBlock&, std::size_t, float, std::int16_t*);
template void quantise(const SampleBlock&, std::size_t, float, float*);
template void quantise(const float*, std::size_t, float, std::int8_t*);
template void quantise(const float*, std::size_t, float, std::int16_t*);
template void quantise(const float*, std::size_t, float, float*);

namespace {

/// Modified Bessel function of the first kind and order 0, by its series.
double bessel_i0(double x) {
  double sum = 1, term = 1;
  for (int k = 1; term > 1e-17 * sum; ++k) {
    term *= x / (2 * k) * (x / (2 * k));
    sum += term;
  }
  return sum;
}

}  // namespace

void FrontEnd::validate() const {
  if (!(rate_hz >= 1e6 && rate_hz <= 200e6))
    throw InputError(fmt::format("{} samples per second are out of range", rate_hz), "give 1e6 to 200e6");
  if (!(centre_hz >= 1e9 && centre_hz <= 2e9)) {
    throw InputError(fmt::format("a centre of {} Hz is out of range", centre_hz),
                     "give 1e9 to 2e9 Hz, e.g. 1575.42e6");
  }
  if (!(centre_hz > lowest_hz() && centre_hz < highest_hz())) {
    throw InputError(
        fmt::format(
            "an intermediate frequency of {} Hz is aliased: {} {} samples per second carry {} to {} Hz",
            intermediate_hz, rate_hz, real ? "real" : "complex", lowest_hz() - zero_hz(), rate_hz / 2),
        real ? fmt::format("give at least half the band's width, and at most {} Hz less that half; {} Hz "
                           "leaves the widest band",
                           rate_hz / 2, rate_hz / 4)
             : "choose a higher sample rate or a lower intermediate frequency");
  }
  if (bandwidth_hz == 0) return;
  if (!(bandwidth_hz >= rate_hz / 50 && kStopLeast * bandwidth_hz <= room_hz())) {
    throw InputError(fmt::format("a filter of {} Hz needs {} Hz on either side, but only {} Hz are available",
                                 bandwidth_hz, kStopLeast * bandwidth_hz, room_hz()),
                     fmt::format("give {} to {} Hz{}", rate_hz / 50, room_hz() / kStopLeast,
                                 room_hz() < rate_hz / (real ? 4 : 2)
                                     ? fmt::format(", or {} the intermediate frequency",
                                                   real ? "a quarter of the rate for" : "lower")
                                     : ""));
  }
}

bool carries(const FrontEnd& front_end, const gnss::Signal& signal, double carrier_hz) {
  propagation::Spectrum spectrum;
  spectrum.shape = propagation::Spectrum::Shape::Code;
  spectrum.centre_hz = carrier_hz;
  spectrum.modulation = signal.modulation;
  spectrum.chip_rate_hz = signal.chip_rate_hz;
  double width_hz = 2 * std::min(carrier_hz - front_end.lowest_hz(), front_end.highest_hz() - carrier_hz);
  if (front_end.bandwidth_hz > 0)
    width_hz = std::min(width_hz, front_end.bandwidth_hz - 2 * std::abs(carrier_hz - front_end.centre_hz));
  return width_hz > 0 && tracking::fraction_within(spectrum, carrier_hz, width_hz) >= kMinFraction;
}

std::vector<float> low_pass(double rate_hz, double pass_hz, double stop_hz) {
  assert(pass_hz > 0 && pass_hz < stop_hz && stop_hz < rate_hz / 2);
  constexpr double kStopped_db = 61;
  const double beta = 0.1102 * (kStopped_db - 8.7);
  const double transition = 2 * geodesy::kPi * (stop_hz - pass_hz) / rate_hz;
  const int half = static_cast<int>(std::ceil((kStopped_db - 7.95) / (2.285 * transition) / 2));
  const double edge = (pass_hz + stop_hz) / rate_hz;  // twice the half-amplitude frequency [cycles/sample]
  std::vector<double> exact;
  double energy = 0;
  for (int k = -half; k <= half; ++k) {
    const double x = geodesy::kPi * edge * k;
    const double position = static_cast<double>(k) / half;
    exact.push_back((k == 0 ? 1 : std::sin(x) / x) * bessel_i0(beta * std::sqrt(1 - position * position)));
    energy += exact.back() * exact.back();
  }
  std::vector<float> taps;
  for (const double tap : exact) taps.push_back(static_cast<float>(tap / std::sqrt(energy)));
  return taps;
}

}  // namespace canyon::samples
