#include "canyon/receiver/tracking/correlation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <complex>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::tracking {
namespace {

using geodesy::kPi;

/// Half periods of BOC(6,1) in a chip: the finest grid that the symbols need.
constexpr int kCells = 12;
using Pulse = std::array<double, kCells>;
constexpr double kTableChips = 4;
constexpr double kStepsPerCycle = 32;

/// R(k / 12 chip), k = 0 ... 12. At the peak, TMBOC chips coincide with chips of the same kind only.
std::array<double, kCells + 1> correlation_of(Modulation modulation) {
  std::array<double, kCells + 1> r{};
  const int chips = chips_per_pattern(modulation);
  for (int chip = 0; chip < chips; ++chip) {
    Pulse pulse;
    for (std::size_t i = 0; i < kCells; ++i) {
      pulse[i] =
          subcarrier(modulation, (static_cast<double>(i) + 0.5) / kCells, static_cast<std::size_t>(chip));
    }
    for (std::size_t lag = 0; lag <= kCells; ++lag) {
      double sum = 0;
      for (std::size_t i = lag; i < kCells; ++i) sum += pulse[i] * pulse[i - lag];
      r[lag] += sum / kCells / chips;
    }
  }
  return r;
}

}  // namespace

int slots_per_chip(Modulation modulation) {
  if (modulation == Modulation::BPSK) return 1;
  return modulation == Modulation::BOC11 ? 2 : 12;
}

int chips_per_pattern(Modulation modulation) {
  return modulation == Modulation::TMBOC ? 33 : 1;
}

double subcarrier(Modulation modulation, double fraction, std::size_t chip) {
  const double boc11 = fraction < 0.5 ? 1 : -1;
  const double boc61 = static_cast<int>(fraction * 12) % 2 == 0 ? 1 : -1;
  switch (modulation) {
    case Modulation::BPSK:
      return 1;
    case Modulation::BOC11:
      return boc11;
    // Galileo OS SIS ICD 2.1, 2.3.3.
    case Modulation::CBOCData:
      return std::sqrt(10.0 / 11) * boc11 + std::sqrt(1.0 / 11) * boc61;
    case Modulation::CBOCPilot:
      return std::sqrt(10.0 / 11) * boc11 - std::sqrt(1.0 / 11) * boc61;
    case Modulation::TMBOC: {
      const std::size_t index = chip % 33;
      return index == 0 || index == 4 || index == 6 || index == 29 ? boc61 : boc11;
    }
    case Modulation::BOC61:
      return boc61;
  }
  assert(false);
  return 0;
}

void CorrelationOptions::validate() const {
  if (!(chip_rate_hz >= 1e5 && chip_rate_hz <= 1e8)) {
    throw InputError(fmt::format("chip_rate_hz of a signal is {}", chip_rate_hz),
                     "give 1e5 to 1e8 chips per second");
  }
  if (std::isinf(bandwidth_hz) && bandwidth_hz > 0) return;
  if (!(bandwidth_hz >= 0.5 * chip_rate_hz && bandwidth_hz <= 1000 * chip_rate_hz)) {
    throw InputError(fmt::format("bandwidth_hz of the front end is {} for {} chips per second", bandwidth_hz,
                                 chip_rate_hz),
                     "give 0.5 to 1000 times the chip rate, or infinity");
  }
}

double sine_integral(double x) {
  const double a = std::abs(x);
  if (a <= 4) {
    const double square = x * x;
    double power = x;  // (-1)^n x^(2n+1) / (2n+1)!
    double sum = x;
    for (int n = 1; n < 40; ++n) {
      power *= -square / ((2.0 * n) * (2.0 * n + 1));
      const double term = power / (2.0 * n + 1);
      sum += term;
      if (std::abs(term) < 1e-17) break;
    }
    return sum;
  }
  // E1(z) = e^-z / (z + 1 - 1 / (z + 3 - 4 / (z + 5 - ...))), z = ia, by Lentz's method.
  using Complex = std::complex<double>;
  const auto inverse = [](const Complex& z) { return std::conj(z) / std::norm(z); };
  Complex b(1, a);
  Complex c_inverse(0, 0);
  Complex d = inverse(b);
  Complex h = d;
  for (int i = 1; i < 500; ++i) {
    const double n = -static_cast<double>(i) * i;
    b += 2.0;
    d = inverse(n * d + b);
    const Complex c = b + n * c_inverse;
    c_inverse = inverse(c);
    const Complex delta = c * d;
    h *= delta;
    if (std::norm(delta - 1.0) < 1e-32) break;
  }
  const double si = kPi / 2 + std::imag(std::polar(1.0, -a) * h);
  return x < 0 ? -si : si;
}

Correlation::Correlation(const CorrelationOptions& options) : options_(options) {
  options_.validate();
  chip_m_ = geodesy::kSpeedOfLight / options_.chip_rate_hz;
  const std::array<double, kCells + 1> r = correlation_of(options_.modulation);
  const int stride = kCells / slots_per_chip(options_.modulation);
  knot_spacing_ = static_cast<double>(stride) / kCells;
  for (int i = 0; i <= kCells; i += stride) knot_values_.push_back(r[static_cast<std::size_t>(i)]);

  if (std::isinf(options_.bandwidth_hz)) return;
  bandwidth_ = options_.bandwidth_hz / options_.chip_rate_hz;
  const int last = static_cast<int>(knot_values_.size()) - 1;
  const auto knot = [&](int k) {
    return std::abs(k) <= last ? knot_values_[static_cast<std::size_t>(std::abs(k))] : 0.0;
  };
  for (int k = -last; k <= last; ++k)
    jumps_.push_back((knot(k + 1) - 2 * knot(k) + knot(k - 1)) / knot_spacing_);
  step_ = 1 / (kStepsPerCycle * std::max(bandwidth_, 1.0));
  const int steps = static_cast<int>(std::ceil(kTableChips / step_));
  steps_per_chip_ = 1 / step_;
  table_steps_ = steps;
  table_.reserve(2 * static_cast<std::size_t>(steps + 1));
  for (int i = 0; i <= steps; ++i) {
    table_.push_back(filtered(i * step_));
    table_.push_back(i == 0 ? 0 : filtered_slope(i * step_) * step_);  // without rounding at the peak
  }
}

double Correlation::density(double frequency) const {
  const double x = kPi * frequency * knot_spacing_;
  const double sinc = std::abs(x) < 1e-8 ? 1 : std::sin(x) / x;
  double sum = knot_values_.front();
  for (std::size_t k = 1; k < knot_values_.size(); ++k)
    sum += 2 * knot_values_[k] * std::cos(2 * x * static_cast<double>(k));
  return knot_spacing_ * sinc * sinc * sum;
}

double Correlation::filtered(double delay_chips) const {
  double knot = -1;
  double sum = 0;
  for (const double jump : jumps_) {
    const double x = delay_chips - knot;
    const double phase = kPi * bandwidth_ * x;
    sum += jump * (x * sine_integral(phase) / kPi + std::cos(phase) / (kPi * kPi * bandwidth_));
    knot += knot_spacing_;
  }
  return sum;
}

double Correlation::filtered_slope(double delay_chips) const {
  double knot = -1;
  double sum = 0;
  for (const double jump : jumps_) {
    sum += jump * sine_integral(kPi * bandwidth_ * (delay_chips - knot)) / kPi;
    knot += knot_spacing_;
  }
  return sum;
}

double Correlation::beyond_table(double delay_chips) const {
  const double a = std::abs(delay_chips);
  if (bandwidth_ != 0) return filtered(a);
  if (!(a < 1)) return 0;
  const double position = a / knot_spacing_;
  const auto i = std::min(static_cast<std::size_t>(position), knot_values_.size() - 2);
  const double t = position - static_cast<double>(i);
  return knot_values_[i] + t * (knot_values_[i + 1] - knot_values_[i]);
}

double Correlation::slope(double delay_chips) const {
  const double a = std::abs(delay_chips);
  const double sign = delay_chips < 0 ? -1 : 1;
  if (bandwidth_ == 0) {
    if (a > 1 || a == 0) return 0;
    const double position = a / knot_spacing_;
    const auto i = std::min(static_cast<std::size_t>(position), knot_values_.size() - 1);
    const auto rise = [&](std::size_t k) {
      return k + 1 < knot_values_.size() ? (knot_values_[k + 1] - knot_values_[k]) / knot_spacing_ : 0.0;
    };
    if (position == static_cast<double>(i) && i > 0) return sign * (rise(i - 1) + rise(i)) / 2;
    return sign * rise(i);
  }
  const double position = a / step_;
  const std::size_t last = table_.size() / 2 - 1;
  if (!(position < static_cast<double>(last))) return sign * filtered_slope(a);
  const auto i = static_cast<std::size_t>(position);
  const double t = position - static_cast<double>(i);
  const double* p = table_.data() + 2 * i;
  const double rise = p[2] - p[0];
  return sign * (p[1] + t * (2 * (3 * rise - 2 * p[1] - p[3]) + 3 * t * (p[1] + p[3] - 2 * rise))) / step_;
}

}  // namespace canyon::tracking
