#include "canyon/tracking/interference.hpp"

#include <algorithm>
#include <cmath>

#include "canyon/geodesy/constants.hpp"
#include "canyon/propagation/index/knife_edge.hpp"

namespace canyon::tracking {
namespace {

using geodesy::kPi;
using propagation::Spectrum;
using Shape = propagation::Spectrum::Shape;

constexpr double kChipRates = 64;  // to where spectra are followed
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

bool has_lines(const Spectrum& s) {
  return s.shape == Shape::Chirp && s.width_hz * s.period_s <= kLinesOfChirp;
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
  if (!has_lines(other)) {
    return integral(std::max(-edge, offset - other.width_hz / 2), std::min(edge, offset + other.width_hz / 2),
                    rate, density) /
           other.width_hz;
  }
  const int most = static_cast<int>(std::ceil(other.width_hz * other.period_s)) + 16;
  double sum = 0;
  for (int k = -most; k <= most; ++k) {
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

double share_within(const Spectrum& s, double centre_hz, double bandwidth_hz) {
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
