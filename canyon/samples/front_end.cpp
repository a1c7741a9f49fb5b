#include "canyon/samples/front_end.hpp"

#include <fmt/format.h>

#include <cassert>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/tracking/interference.hpp"

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

void FrontEnd::validate() const {
  if (!(rate_hz >= 1e6 && rate_hz <= 200e6)) {
    throw InputError(fmt::format("{} samples per second are out of range", rate_hz), "give 1e6 to 200e6");
  }
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
    throw InputError(fmt::format("a filter of {} Hz needs {} Hz to either side, and {} Hz are there",
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
  if (front_end.bandwidth_hz > 0) {
    width_hz = std::min(width_hz, front_end.bandwidth_hz - 2 * std::abs(carrier_hz - front_end.centre_hz));
  }
  return width_hz > 0 && tracking::share_within(spectrum, carrier_hz, width_hz) >= kLeastShare;
}

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
