#include "canyon/samples/front_end_filter.hpp"

#include <cassert>
#include <cmath>

#include "canyon/geodesy/constants.hpp"

namespace canyon::samples {
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

std::vector<float> low_pass(double rate_hz, double pass_hz, double stop_hz) {
  assert(pass_hz > 0 && pass_hz < stop_hz && stop_hz < rate_hz / 2);
  constexpr double kStopped_db = 61;
  const double beta = 0.1102 * (kStopped_db - 8.7);
  const double transition = 2 * geodesy::kPi * (stop_hz - pass_hz) / rate_hz;
  const int half = static_cast<int>(std::ceil((kStopped_db - 7.95) / (2.285 * transition) / 2));
  const double edge = (pass_hz + stop_hz) / rate_hz;  // half of the amplitude, cycles per sample, twice
  std::vector<double> exact;
  double energy = 0;
  for (int k = -half; k <= half; ++k) {
    const double x = geodesy::kPi * edge * k;
    const double place = static_cast<double>(k) / half;
    exact.push_back((k == 0 ? 1 : std::sin(x) / x) * bessel_i0(beta * std::sqrt(1 - place * place)));
    energy += exact.back() * exact.back();
  }
  std::vector<float> taps;
  for (const double tap : exact) taps.push_back(static_cast<float>(tap / std::sqrt(energy)));
  return taps;
}

}  // namespace canyon::samples
