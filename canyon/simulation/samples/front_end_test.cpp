#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/simulation/samples/mixer.hpp"

namespace canyon::samples::front_end_test {
namespace {

double gain_db(const std::vector<float>& taps, double cycles_per_sample) {
  std::complex<double> sum, whole;
  for (std::size_t k = 0; k < taps.size(); ++k) {
    sum += static_cast<double>(taps[k]) *
           std::polar(1.0, 2 * geodesy::kPi * cycles_per_sample * static_cast<double>(k));
    whole += taps[k];
  }
  return 20 * std::log10(std::abs(sum) / std::abs(whole));
}

TEST(FrontEndFilter, IsFlatAndStops) {
  for (const auto& [rate, pass, stop] :
       {std::tuple{16e6, 1.25e6, 1.875e6}, {16e6, 1.8e6, 1.98e6}, {80e6, 1e6, 1.5e6}}) {
    const std::vector<float> taps = low_pass(rate, pass, stop);
    EXPECT_EQ(taps.size() % 2, 1U);
    double energy = 0;
    for (std::size_t k = 0; k < taps.size(); ++k) {
      energy += taps[k] * taps[k];
      EXPECT_EQ(taps[k], taps[taps.size() - 1 - k]);
    }
    EXPECT_NEAR(energy, 1, 1e-6);
    for (double hz = 0; hz <= pass; hz += pass / 200) EXPECT_NEAR(gain_db(taps, hz / rate), 0, 0.02) << hz;
    for (double hz = stop; hz <= rate / 2; hz += stop / 50) EXPECT_LT(gain_db(taps, hz / rate), -60) << hz;
  }
}

TEST(FrontEndFilter, DecimatesByItsSums) {
  std::vector<float> in(100), taps(2 * kLanes), out(9);
  for (std::size_t i = 0; i < in.size(); ++i) in[i] = static_cast<float>(i * i % 37);
  for (std::size_t k = 0; k < taps.size(); ++k) taps[k] = static_cast<float>(k % 5) - 2;
  decimate(in.data(), taps, 4, out.size(), out.data());
  for (std::size_t n = 0; n < out.size(); ++n) {
    float sum = 0;
    for (std::size_t k = 0; k < taps.size(); ++k) sum += taps[k] * in[4 * n + k];
    EXPECT_EQ(out[n], sum) << n;
  }
}

}  // namespace
}  // namespace canyon::samples::front_end_test
