#include "canyon/receiver/tracking/channel_fading.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "canyon/base/geodesy/constants.hpp"

namespace canyon::tracking {
namespace {

using Complex = std::complex<double>;
using geodesy::kPi;

constexpr double kNoOffset = 0;

Complex rate(double decay_per_s, double offset_hz) {
  return {decay_per_s, -2 * kPi * offset_hz};
}

// J0(2 pi d / wavelength) falls to 1/e at kCoherenceWavelengths; std::cyl_bessel_j is the reference.
TEST(ChannelFading, CoherenceIsClarkes) {
  EXPECT_NEAR(std::cyl_bessel_j(0.0, 2 * kPi * kCoherenceWavelengths), std::exp(-1.0), 2e-5);
}

// A wave without decay: sinc^2(pi f T).
TEST(ChannelFading, IntegrationOfASingleWaveIsSinc) {
  for (const double offset : {1e-3, 0.3, 7.0, 33.0, 60.0}) {
    const double x = kPi * offset * 0.02;
    EXPECT_NEAR(integrated_power(rate(0, offset), 0.02), std::pow(std::sin(x) / x, 2), 1e-9) << offset;
  }
  EXPECT_EQ(integrated_power({0, 0}, 0.02), 1);
}

// E|mean over T of x|^2 is the double sum of the autocorrelation, here by the midpoint rule.
TEST(ChannelFading, IntegrationOfABundleIsTheDoubleIntegral) {
  constexpr double kT = 0.02;
  constexpr int kSteps = 20'000;
  for (const double decay : {0.01, 20.0, 300.0}) {
    for (const double offset : {kNoOffset, 12.0, 80.0}) {
      double sum = 0;
      for (int i = 0; i < kSteps; ++i) {
        const double u = (i + 0.5) / kSteps;  // lag over T
        sum += 2 * (1 - u) * std::exp(-decay * u * kT) * std::cos(2 * kPi * offset * u * kT) / kSteps;
      }
      EXPECT_NEAR(integrated_power(rate(decay, offset), kT), sum, 1e-7) << decay << " " << offset;
    }
  }
}

// Both branches agree at the transition.
TEST(ChannelFading, IntegrationHasNoStep) {
  const Complex direction = std::polar(1.0, 1.2);
  EXPECT_NEAR(integrated_power(0.99999e-3 * direction, 1), integrated_power(1.00001e-3 * direction, 1), 1e-8);
}

// One wave has 1 / (1 + (2 pi f / 4 Bn)^2). A decay alone has k / (k + 1/tau), the closed form of an OU
// process after a first-order filter. Both together have the integral of |H|^2 S over frequency.
TEST(ChannelFading, FilteredShareIsTheLoops) {
  EXPECT_NEAR(filtered_fraction(rate(0, 3), 1), 1 / (1 + std::pow(2 * kPi * 3 / 4, 2)), 1e-12);
  EXPECT_NEAR(filtered_fraction(rate(6, 0), 1), 4.0 / (4 + 6), 1e-12);
  constexpr double kDecay = 5, kOffset = 0.7, kK = 4;
  double sum = 0;
  const double step = 2e-3;
  for (double f = -2000 + step / 2; f < 2000; f += step) {
    const double filter = kK * kK / (kK * kK + std::pow(2 * kPi * f, 2));
    const double density = 2 * kDecay / (kDecay * kDecay + std::pow(2 * kPi * (f - kOffset), 2));
    sum += filter * density * step;
  }
  EXPECT_NEAR(filtered_fraction(rate(kDecay, kOffset), 1), sum, 1e-6);
}

TEST(PathFades, MirrorsKeepTheirPhase) {
  const PathPhases phases(3, "rover");
  PathFades fades("G05", RandomStream(3, "x"));
  fades.next_epoch();
  const Complex first = fades.fixed(phases, 77);
  EXPECT_NEAR(std::abs(first), 1, 1e-12);
  EXPECT_NEAR(std::arg(first), phases.phase_rad("G05", 77), 1e-12);
  fades.next_epoch();
  EXPECT_EQ(fades.fixed(phases, 77), first);
  fades.next_epoch();
  fades.next_epoch();
  EXPECT_EQ(fades.fixed(phases, 77), first);
  EXPECT_NE(fades.fixed(phases, 78), first);
}

/// Moments of a cluster's factor, `steps` of decay `decay` apart.
struct Moments {
  double power = 0, power_squared = 0, product = 0;
};
Moments moments(double decay, int steps, int count) {
  PathFades fades("G05", RandomStream(11, "bundle"));
  Moments result;
  Complex last;
  for (int i = 0; i <= count; ++i) {
    Complex now;
    for (int k = 0; k < steps; ++k) {
      fades.next_epoch();
      now = fades.rayleigh(9, decay / steps);
    }
    const double power = std::norm(now);
    if (i > 0) {
      result.power += power / count;
      result.power_squared += power * power / count;
      result.product += (now * std::conj(last)).real() / count;
    }
    last = now;
  }
  return result;
}

// |g|^2 is exponential: mean 1, mean square 2 (deviations 1 and sqrt(20)); autocorrelation e^-decay, in one
// step or in ten. Five deviations, with the count of independent samples n (1 - rho^2) / (1 + rho^2).
TEST(PathFades, BundlesAreRayleighAtAnyRate) {
  constexpr int kCount = 40'000;
  const double rho = std::exp(-0.5);
  const double n = kCount * (1 - rho * rho) / (1 + rho * rho);
  for (const int steps : {1, 10}) {
    const Moments m = moments(0.5, steps, kCount);
    EXPECT_NEAR(m.power, 1, 5 / std::sqrt(n)) << steps;
    EXPECT_NEAR(m.power_squared, 2, 5 * std::sqrt(20 / n)) << steps;
    EXPECT_NEAR(m.product, rho, 5 / std::sqrt(n)) << steps;
  }
}

TEST(PathFades, BundlesStandWithTheAntennaAndAreForgotten) {
  PathFades fades("G05", RandomStream(11, "bundle"));
  fades.next_epoch();
  const Complex first = fades.rayleigh(9, 5);
  fades.next_epoch();
  EXPECT_EQ(fades.rayleigh(9, 0), first);
  fades.next_epoch();
  fades.next_epoch();
  EXPECT_NE(fades.rayleigh(9, 0), first);
  fades.clear();
  fades.next_epoch();
  EXPECT_NE(fades.rayleigh(9, 0), first);
}

}  // namespace
}  // namespace canyon::tracking
