#include "canyon/receiver/tracking/loop_noise.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/paths/propagation/index/knife_edge.hpp"

namespace canyon::tracking {

namespace {

OuOptions unit_process(double loop_bandwidth_hz) {
  if (!(loop_bandwidth_hz > 0) || !std::isfinite(loop_bandwidth_hz)) {
    throw InputError(fmt::format("loop_bandwidth_hz of a noise is {}", loop_bandwidth_hz),
                     "give a bandwidth above 0 Hz");
  }
  OuOptions options;
  options.theta_per_s = 4 * loop_bandwidth_hz;
  options.sigma_m_per_sqrt_s = std::sqrt(2 * options.theta_per_s);
  return options;
}

}  // namespace

double cn0_hz(double cn0_dbhz) {
  if (!std::isfinite(cn0_dbhz))
    throw InputError(fmt::format("a C/N0 is {} dB-Hz", cn0_dbhz), "it must be finite");
  return std::pow(10, cn0_dbhz / 10);
}

CodeLoopNoise::CodeLoopNoise(const CodeTracker& tracker)
    : bandwidth_hz_(tracker.options().loop_bandwidth_hz), integration_s_(tracker.options().integration_s) {
  const DllOptions& loop = tracker.options();
  const Correlation& r = tracker.correlation();
  const CorrelatorBank bank = correlator_bank(loop);
  const auto count = static_cast<std::size_t>(bank.count);
  double variance = 0;
  double slope = 0;
  for (std::size_t i = 0; i < count; ++i) {
    slope += bank.weight[i] * r.slope(bank.offset_chips[i]);
    for (std::size_t k = 0; k < count; ++k)
      variance += bank.weight[i] * bank.weight[k] * r.value(bank.offset_chips[i] - bank.offset_chips[k]);
  }
  const double metres = r.chip_m() / slope;
  first_ = variance * metres * metres;
  switch (loop.discriminator) {
    case Discriminator::Coherent:
      break;
    case Discriminator::EarlyLatePower: {
      const double side = r.value(loop.spacing_chips / 2);
      second_ = first_ * (r.value(0) + r.value(loop.spacing_chips)) / (2 * integration_s_ * side * side);
      break;
    }
    case Discriminator::DotProduct:
    case Discriminator::DoubleDelta:
      second_ = first_ / (integration_s_ * r.value(0));
      break;
  }
  narrow_from_ = loop.narrow_below_dbhz > 0 ? density(cn0_hz(loop.narrow_below_dbhz))
                                            : std::numeric_limits<double>::infinity();
}

double CodeLoopNoise::bandwidth_ratio(double cn0) const {
  const double now = density(cn0);
  return now > narrow_from_ ? std::sqrt(narrow_from_ / now) : 1;
}

double CodeLoopNoise::sigma_m(double cn0) const {
  const double bandwidth = bandwidth_hz_ * bandwidth_ratio(cn0);
  return std::sqrt(bandwidth * (1 - bandwidth * integration_s_ / 2) * density(cn0));
}

double pll_jitter_rad(const PllOptions& options, double cn0_dbhz) {
  const double ratio = cn0_hz(cn0_dbhz);
  return std::sqrt(options.loop_bandwidth_hz / ratio * (1 + 1 / (2 * options.integration_s * ratio)));
}

double fll_jitter_hz(const FllOptions& options, double cn0_dbhz) {
  const double ratio = cn0_hz(cn0_dbhz);
  const double t = options.integration_s;
  return std::sqrt(4 * options.loop_bandwidth_hz / ratio * (1 + 1 / (t * ratio))) / (2 * geodesy::kPi * t);
}

LoopNoise::LoopNoise(double loop_bandwidth_hz, RandomStream stream)
    : process_(unit_process(loop_bandwidth_hz), stream) {}

double LoopNoise::advance(double dt_s, double sigma) {
  if (!(sigma >= 0) || !std::isfinite(sigma)) {
    throw InputError(fmt::format("the standard deviation of a noise is {}", sigma),
                     "give a finite value of 0 or more");
  }
  return sigma * process_.advance(dt_s);
}

template <bool kPhase>
void CarrierLoopOptions<kPhase>::validate() const {
  constexpr const char* kLoop = kPhase ? "phase lock loop" : "frequency lock loop";
  options::check(*this, kLoop);
  check_bandwidths(loop_bandwidth_hz, loop_bandwidths_hz, integration_s, kLoop);
}

template <bool kPhase>
void visit(options::Visitor& v, CarrierLoopOptions<kPhase>& o) {
  v.number({"loop_bandwidth_hz", "Hz",
            kPhase ? "one-sided noise bandwidth of the phase loop"
                   : "one-sided noise bandwidth of the frequency loop (Doppler)"},
           o.loop_bandwidth_hz, {0, 100, true});
  gnss::visit_signal_values(v, {"loop_bandwidths_hz", "Hz", "of signals with another bandwidth"},
                            o.loop_bandwidths_hz, {0, 100, true});
  v.number({"integration_s", "s", "coherent integration"}, o.integration_s, {0, 10, true});
}

template struct CarrierLoopOptions<true>;
template struct CarrierLoopOptions<false>;
template void visit(options::Visitor& v, PllOptions& o);
template void visit(options::Visitor& v, FllOptions& o);

namespace {

using geodesy::kPi;
using propagation::Spectrum;
using Shape = propagation::Spectrum::Shape;

constexpr double kChipRates = 64;  // range of the spectra
constexpr double kLinesOfChirp = 20'000;

/// Simpson's rule with steps that resolve the spectrum of `chip_rate_hz`.
template <typename Density>
double integral(double low_hz, double high_hz, double chip_rate_hz, const Density& density) {
  if (!(high_hz > low_hz)) return 0;
  const int pairs = std::max(8, static_cast<int>(std::ceil((high_hz - low_hz) / chip_rate_hz * 16)));
  const double step = (high_hz - low_hz) / (2 * pairs);
  double sum = density(low_hz) + density(high_hz);
  for (int i = 1; i < 2 * pairs; ++i) sum += (i % 2 == 1 ? 4 : 2) * density(low_hz + i * step);
  return sum * step / 3;
}

/// Power of a line [1] of a chirp of unit power, |f| from the middle of its band.
double chirp_line(const Spectrum& chirp, double offset_hz) {
  const double scale = std::sqrt(2 * chirp.width_hz / chirp.period_s);
  const double late = -offset_hz / chirp.width_hz * chirp.period_s;
  const double half = chirp.period_s / 2;
  return std::norm(propagation::fresnel_integral(scale * (half + late)) -
                   propagation::fresnel_integral(scale * (late - half))) /
         (2 * chirp.width_hz * chirp.period_s);
}

}  // namespace

double spectral_separation_per_hz(const Correlation& signal, double carrier_hz, const Spectrum& other) {
  const double rate = signal.options().chip_rate_hz;
  const double edge = signal.options().bandwidth_hz / 2;
  const double offset = other.centre_hz - carrier_hz;
  const auto density = [&](double f_hz) { return signal.density(f_hz / rate) / rate; };
  if (other.shape == Shape::Tone) return std::abs(offset) <= edge ? density(offset) : 0;
  if (other.shape == Shape::Code) {
    const Correlation code({other.modulation, other.chip_rate_hz});
    const double far = std::min(edge, std::abs(offset) + kChipRates * std::max(rate, other.chip_rate_hz));
    return integral(-far, far, std::min(rate, other.chip_rate_hz), [&](double f_hz) {
      return density(f_hz) * code.density((f_hz - offset) / other.chip_rate_hz) / other.chip_rate_hz;
    });
  }
  if (other.shape != Shape::Chirp || !(other.width_hz * other.period_s <= kLinesOfChirp)) {
    return integral(std::max(-edge, offset - other.width_hz / 2), std::min(edge, offset + other.width_hz / 2),
                    rate, density) /
           other.width_hz;
  }
  const int maximum = static_cast<int>(std::ceil(other.width_hz * other.period_s)) + 16;
  double sum = 0;
  for (int k = -maximum; k <= maximum; ++k) {
    const double line_hz = k / other.period_s;
    if (std::abs(offset + line_hz) <= edge) sum += chirp_line(other, line_hz) * density(offset + line_hz);
  }
  return sum;
}

double line_factor(double offset_hz, double line_hz, double integration_s) {
  const double repetitions = integration_s * line_hz;
  if (!(repetitions > 1)) return 1;
  const double one = std::sin(kPi * std::remainder(offset_hz / line_hz, 1.0));
  if (std::abs(one) < 1e-9) return repetitions;
  const double all = std::sin(kPi * std::remainder(offset_hz * integration_s, 1.0));
  return all * all / (repetitions * one * one);
}

double fraction_within(const Spectrum& s, double centre_hz, double bandwidth_hz) {
  const double low = centre_hz - bandwidth_hz / 2 - s.centre_hz, high = low + bandwidth_hz;
  if (s.shape == Shape::Tone) return low <= 0 && high >= 0 ? 1 : 0;
  if (s.shape == Shape::Code) {
    const Correlation code({s.modulation, s.chip_rate_hz});
    const double far = kChipRates * s.chip_rate_hz;
    return integral(std::max(low, -far), std::min(high, far), s.chip_rate_hz,
                    [&](double f_hz) { return code.density(f_hz / s.chip_rate_hz) / s.chip_rate_hz; });
  }
  const double half = s.width_hz / 2;
  return std::max(0.0, std::min(high, half) - std::max(low, -half)) / s.width_hz;
}

double small_signal_gain(double over_compression) {
  constexpr double kBlocked = 1e-3;
  return std::max(kBlocked, 1 - 1.5 * 0.145 * over_compression);
}

double gain_for(const signal::AntennaPattern& antenna, const propagation::Interference& wave,
                signal::Band band) {
  const double in_band_hz = band == signal::Band::Lower ? 1.2e9 : gnss::kL1_hz;
  const signal::AntennaGain gain =
      antenna.gain(std::asin(std::clamp(wave.arrival.z(), -1.0, 1.0)), in_band_hz);
  const double right = std::pow(10, gain.rhcp_dbic / 10), left = std::pow(10, gain.lhcp_dbic / 10);
  switch (wave.polarisation) {
    case propagation::Polarisation::Right:
      return right;
    case propagation::Polarisation::Left:
      return left;
    case propagation::Polarisation::Linear:
      break;
  }
  return (right + left) / 2;
}

}  // namespace canyon::tracking
