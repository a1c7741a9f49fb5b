#include "canyon/simulation/samples/generator.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/simulation/samples/path_interpolator.hpp"

namespace canyon::samples {
namespace {

using geodesy::kSpeedOfLight;
using Complex = std::complex<double>;

constexpr double kCycle_rad = 2 * geodesy::kPi;
constexpr float kSqrt2 = 1.41421356F;
constexpr std::size_t kBlocksAtOnce = 64;
/// Paths of less than this C/N0 [Hz] are left out.
constexpr double kMinCn0_hz = 1;

/// Complex noise of power 1, flat within a band of this width about 0 Hz, a function of time: independent
/// values 1 / width apart, interpolated by low_pass() in its kPhases phases.
class BandNoise {
 public:
  BandNoise(std::uint64_t key, double begin_s, double end_s, double width_hz)
      : width_hz_(width_hz), first_(static_cast<std::int64_t>(std::floor(begin_s * width_hz)) - kReach) {
    const auto end = static_cast<std::int64_t>(std::ceil(end_s * width_hz)) + kReach;
    for (std::int64_t step = first_; step <= end; ++step) {
      RandomStream stream = keyed_stream(key ^ mix64(static_cast<std::uint64_t>(step)));
      const double re = stream.normal(), im = stream.normal();
      values_.emplace_back(re, im);
    }
  }

  /// Precondition: within the times of the constructor
  [[nodiscard]] Complex at(double seconds) const {
    static const std::vector<float> taps = low_pass(kPhases, 0.45, 0.55);
    const std::int64_t middle = static_cast<std::int64_t>(taps.size() / 2);
    const auto at = std::llround((seconds * width_hz_ - static_cast<double>(first_)) * kPhases) + middle;
    // The values within the filter's length.
    std::int64_t tap = at % kPhases;
    Complex sum;
    for (std::int64_t k = at / kPhases; tap < static_cast<std::int64_t>(taps.size()); --k, tap += kPhases)
      sum += values_[static_cast<std::size_t>(k)] * static_cast<double>(taps[static_cast<std::size_t>(tap)]);
    // The values have a variance of 2, and the taps the energy of all phases.
    return sum * std::sqrt(kPhases / 2.0);
  }

 private:
  static constexpr int kPhases = 64;
  static constexpr std::int64_t kReach = 20;  // half the filter's length in steps, plus one

  double width_hz_;
  std::int64_t first_;
  std::vector<Complex> values_;
};

}  // namespace

struct Generator::State {
  State(const receiver::ReceiverOptions& options, std::uint64_t seed,
        const std::map<gnss::System, gnss::Klobuchar>& klobuchar, const FrontEnd& sample_front_end,
        int threads)
      : front_end(sample_front_end),
        arena(threads == 0 ? tbb::this_task_arena::max_concurrency()
                           : std::min(threads, tbb::this_task_arena::max_concurrency())) {
    front_end.validate();
    made = front_end;
    if (front_end.bandwidth_hz > 0) {
      made.real = false;
      made.intermediate_hz = made.bandwidth_hz = 0;
      made.rate_hz = front_end.rate_hz * kOversampling;
      per_sample = kOversampling;
      taps = low_pass(made.rate_hz, front_end.bandwidth_hz / 2,
                      std::min(kStop * front_end.bandwidth_hz, front_end.room_hz()));
      history = taps.size() - 1;
      const std::size_t lead_samples = history / 2;
      lead_s = static_cast<double>(lead_samples) / made.rate_hz;
      taps.resize((taps.size() + kLanes - 1) / kLanes * kLanes);
      unfiltered_re.assign(history, 0);
      unfiltered_im.assign(history, 0);
    }
    block_samples = static_cast<std::size_t>(std::llround(front_end.rate_hz * kBlock_s / kLanes)) * kLanes;
    interpolator = make_path_interpolator(options, seed, klobuchar, front_end, made.rate_hz);
  }

  void make(const SignalSegment& segment, std::size_t first, std::size_t samples, std::size_t in_segment,
            SampleBlock& out) const {
    thread_local Slots slots;
    thread_local std::vector<PathBlock> paths;
    out.clear(samples);
    const double begin_s = made_s(first), end_s = made_s(first + samples);
    const auto at = [&](double seconds) { return (seconds - segment.begin_s) / segment.length_s; };
    const double begin = at(begin_s), end = at(end_s), middle = (begin + end) / 2;
    const auto count = static_cast<double>(samples);
    const double least = std::sqrt(kMinCn0_hz * 2 / made.rate_hz);
    for (const SignalSegment::Signal& signal : segment.signals) {
      const double slot_rate = signal.waveform->slot_rate_hz();
      const double wavelength = kSpeedOfLight / signal.carrier_hz;
      const double offset_hz = signal.carrier_hz - made.zero_hz();
      const auto slot_at = [&](const InterpolatedPath& path, double seconds, double s) {
        return (seconds - path.code_m.at(s) / kSpeedOfLight) * slot_rate;
      };
      const auto cycles_at = [&](const InterpolatedPath& path, double seconds, double s) {
        return offset_hz * seconds - path.carrier_m.at(s) / wavelength;
      };
      paths.clear();
      double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
      for (const InterpolatedPath& from : signal.paths) {
        Complex amplitude = from.from + middle * (from.to - from.from);
        if (!from.fading.empty())
          amplitude *= Complex(from.fading[std::min(in_segment, from.fading.size() - 1)]);
        if (std::abs(amplitude) < least) continue;
        PathBlock path;
        path.slot = slot_at(from, begin_s, begin);
        path.slots_per_sample = (slot_at(from, end_s, end) - path.slot) / count;
        const double cycles = cycles_at(from, begin_s, begin);
        path.cycles_per_sample = (cycles_at(from, end_s, end) - cycles) / count;
        path.cycles = std::remainder(cycles, 1) + std::arg(amplitude) / kCycle_rad;
        path.amplitude = std::abs(amplitude);
        lowest = std::min(lowest, path.slot);
        highest = std::max(highest, path.slot + path.slots_per_sample * static_cast<double>(out.re.size()));
        paths.push_back(path);
      }
      if (paths.empty()) continue;
      const double base = std::floor(lowest);
      // Extends beyond the end, for the last batch of samples.
      const auto length =
          static_cast<std::size_t>(highest - base) + 2 + static_cast<std::size_t>(kMaxSlots) * kLanes;
      signal.waveform->send(static_cast<std::int64_t>(base), length, slots);
      for (PathBlock& path : paths) {
        path.slot -= base;
        add_path(slots, path, out);
      }
    }
    interfere(segment, begin_s, out);
    if (made.real)
      for (float& value : out.re) value *= kSqrt2;
    if (front_end.noise) add_noise(interpolator->noise_key() ^ mix64(first + kGolden64), out);
  }

  void interfere(const SignalSegment& segment, double begin_s, SampleBlock& out) const {
    const double lowest_hz = made.lowest_hz() - made.zero_hz();
    const double highest_hz = made.highest_hz() - made.zero_hz();
    const auto band = static_cast<std::size_t>(signal::band_of(front_end.centre_hz));
    std::uint64_t number = 0;
    for (const tracking::ReceivedWave& wave : segment.waves) {
      const std::uint64_t key = mix64(interpolator->noise_key() + ++number * kGolden64);
      const propagation::Spectrum& spectrum = wave.spectrum;
      const double amplitude = std::sqrt(wave.over_noise_hz[band] * 2 / made.rate_hz);
      const double centre_hz = spectrum.centre_hz - made.zero_hz();
      const auto add = [&](auto value_at) {
        for (std::size_t n = 0; n < out.re.size(); ++n) {
          const Complex value = amplitude * value_at(begin_s + static_cast<double>(n) / made.rate_hz);
          out.re[n] += static_cast<float>(value.real());
          out.im[n] += static_cast<float>(value.imag());
        }
      };
      switch (spectrum.shape) {
        case propagation::Spectrum::Shape::Tone:
          if (centre_hz > lowest_hz && centre_hz < highest_hz)
            add_tone(centre_hz * begin_s, centre_hz / made.rate_hz, amplitude, out);
          break;
        case propagation::Spectrum::Shape::Chirp: {
          // A free-running oscillator starts each sweep at another phase: with a constant phase the sweeps
          // would have spectral lines, which most satellites' code lines miss.
          double sweep = std::numeric_limits<double>::quiet_NaN(), start_cycles = 0;
          add([&](double t) {
            const double index = std::floor(t / spectrum.period_s);
            if (index != sweep) {
              sweep = index;
              start_cycles =
                  keyed_stream(key ^ mix64(static_cast<std::uint64_t>(static_cast<std::int64_t>(index))))
                      .uniform();
            }
            const double into_s = t - index * spectrum.period_s;
            const double slope = spectrum.width_hz / spectrum.period_s;
            const double hz = centre_hz - spectrum.width_hz / 2 + slope * into_s;
            if (hz <= lowest_hz || hz >= highest_hz) return Complex();
            const double cycles =
                (centre_hz - spectrum.width_hz / 2 + slope / 2 * into_s) * into_s + start_cycles;
            return std::polar(1.0, kCycle_rad * std::remainder(cycles, 1));
          });
          break;
        }
        case propagation::Spectrum::Shape::Band: {
          const double low = std::max(centre_hz - spectrum.width_hz / 2, lowest_hz);
          const double high = std::min(centre_hz + spectrum.width_hz / 2, highest_hz);
          if (!(high > low)) break;
          const double fraction = std::sqrt((high - low) / spectrum.width_hz);
          const BandNoise noise(key, begin_s, begin_s + static_cast<double>(out.re.size()) / made.rate_hz,
                                high - low);
          add([&](double t) {
            return fraction * noise.at(t) *
                   std::polar(1.0, kCycle_rad * std::remainder((low + high) / 2 * t, 1));
          });
          break;
        }
        case propagation::Spectrum::Shape::Code:
          break;  // a copy: the path is in its satellite's view
      }
    }
  }

  /// @param first of the block @param at index of its samples after the history
  void filter(std::size_t first, std::size_t samples, std::size_t at, SampleBlock& block) const {
    assert(at + per_sample * (samples - 1) + taps.size() <= unfiltered_re.size());
    block.clear(samples);
    decimate(unfiltered_re.data() + at, taps, per_sample, samples, block.re.data());
    decimate(unfiltered_im.data() + at, taps, per_sample, samples, block.im.data());
    if (front_end.intermediate_hz == 0) return;
    const double begin_s = *first_s + static_cast<double>(first) / front_end.rate_hz;
    rotate_phase(front_end.intermediate_hz * begin_s, front_end.intermediate_hz / front_end.rate_hz, block);
  }

  /// From `sample` to `end`, in blocks of block_samples.
  void make_blocks(const SignalSegment& segment, std::size_t end, const BlockHandler& take) {
    const std::size_t size = block_samples;
    for (std::size_t in_segment = 0; sample < end;) {
      const std::size_t count = std::min(kBlocksAtOnce, (end - sample + size - 1) / size);
      const auto samples_of = [&](std::size_t i) { return std::min(size, end - sample - i * size); };
      const std::size_t all = std::min(end - sample, count * size);
      if (!taps.empty()) {
        // The last sums include the taps that are zero.
        unfiltered_re.resize(history + all * per_sample + kLanes);
        unfiltered_im.resize(history + all * per_sample + kLanes);
      }
      arena.execute([&] {
        tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
          const std::size_t first = sample + i * size;
          make(segment, first * per_sample, samples_of(i) * per_sample, in_segment + i, blocks[i]);
          if (taps.empty()) return;
          const auto at = static_cast<std::ptrdiff_t>(history + i * size * per_sample);
          const auto made_here = static_cast<std::ptrdiff_t>(samples_of(i) * per_sample);
          std::copy_n(blocks[i].re.begin(), made_here, unfiltered_re.begin() + at);
          std::copy_n(blocks[i].im.begin(), made_here, unfiltered_im.begin() + at);
        });
        if (taps.empty()) return;
        tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
          filter(sample + i * size, samples_of(i), i * size * per_sample, blocks[i]);
        });
      });
      if (!taps.empty()) {
        for (std::vector<float>* unfiltered : {&unfiltered_re, &unfiltered_im}) {
          const auto from = unfiltered->begin() + static_cast<std::ptrdiff_t>(all * per_sample);
          std::copy_n(from, history, unfiltered->begin());
        }
      }
      for (std::size_t i = 0; i < count; ++i) take(blocks[i], samples_of(i));
      sample += all;
      in_segment += count;
    }
  }

  [[nodiscard]] double made_s(std::size_t number) const {
    return *first_s + static_cast<double>(number) / made.rate_hz + lead_s;
  }

  FrontEnd front_end;
  FrontEnd made;               // the computed samples: without a filter front_end, else the filter's input
  std::size_t per_sample = 1;  // computed samples per output sample
  std::vector<float> taps;     // of the filter, symmetric except for zeros; empty: none
  std::size_t history = 0;     // samples before one that the filter needs
  double lead_s = 0;           // by which samples are computed ahead, for the filter's delay
  std::unique_ptr<PathInterpolator> interpolator;
  tbb::task_arena arena;
  std::size_t block_samples = 0;

  std::optional<double> first_s;  // reading of the first sample
  std::size_t sample = 0;         // number of the next one
  std::vector<SampleBlock> blocks{kBlocksAtOnce};
  std::vector<float> unfiltered_re, unfiltered_im;  // history, then the blocks
};

Generator::Generator(const receiver::ReceiverOptions& options, std::uint64_t seed,
                     const std::map<gnss::System, gnss::Klobuchar>& klobuchar, const FrontEnd& front_end,
                     int threads)
    : state_(std::make_unique<State>(options, seed, klobuchar, front_end, threads)) {}
Generator::~Generator() = default;
Generator::Generator(Generator&&) noexcept = default;
Generator& Generator::operator=(Generator&&) noexcept = default;

void Generator::next(const simulation::Epoch& epoch, const BlockHandler& take) {
  State& state = *state_;
  const std::optional<SignalSegment> segment = state.interpolator->next(epoch);
  const double reading_s = state.interpolator->reading_s();
  if (!state.first_s) state.first_s = reading_s;
  if (!segment) return;
  const auto end =
      static_cast<std::size_t>(std::ceil((reading_s - *state.first_s) * state.front_end.rate_hz - 1e-6));
  state.make_blocks(*segment, end, take);
}

geodesy::GpsTime Generator::begin() const {
  assert(state_->first_s);
  return state_->interpolator->zero() + *state_->first_s;
}

Generator::Contents Generator::contents() const {
  return state_->interpolator->contents();
}

}  // namespace canyon::samples
