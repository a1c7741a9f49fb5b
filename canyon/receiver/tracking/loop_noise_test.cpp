#include "canyon/receiver/tracking/loop_noise.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::tracking::loop_noise_test {
namespace {

using geodesy::kPi;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

CodeTracker tracker(Discriminator discriminator, double spacing, double bandwidth_chips = kInfinite,
                    Modulation modulation = Modulation::BPSK, double loop_hz = 1,
                    double integration_s = 0.02) {
  CorrelationOptions signal;
  signal.modulation = modulation;
  signal.bandwidth_hz = bandwidth_chips * signal.chip_rate_hz;
  DllOptions loop;
  loop.discriminator = discriminator;
  loop.spacing_chips = spacing;
  loop.loop_bandwidth_hz = loop_hz;
  loop.integration_s = integration_s;
  return CodeTracker(signal, loop);
}

double dll_jitter_m(const CodeTracker& tracker, double cn0_dbhz) {
  return CodeLoopNoise(tracker).sigma_m(cn0_hz(cn0_dbhz));
}

double dll_jitter_chips(const CodeTracker& tracker, double cn0_dbhz) {
  return dll_jitter_m(tracker, cn0_dbhz) / tracker.correlation().chip_m();
}

// Infinite bandwidth, BPSK: Bn D / (2 C/N0) times the squaring loss (Kaplan & Hegarty, 2nd ed.,
// equation 5.23, first case), with 1 - Bn T / 2.
TEST(DllJitter, ClosedFormsOfBpsk) {
  for (const double d : {1.0, 0.5, 0.1}) {
    for (const double cn0 : {20.0, 30.0, 45.0}) {
      const double ratio = std::pow(10, cn0 / 10);
      const double coherent = 1.0 * (1 - 0.01) * d / (2 * ratio);
      EXPECT_NEAR(dll_jitter_chips(tracker(Discriminator::Coherent, d), cn0), std::sqrt(coherent), 1e-12);
      EXPECT_NEAR(dll_jitter_chips(tracker(Discriminator::EarlyLatePower, d), cn0),
                  std::sqrt(coherent * (1 + 2 / ((2 - d) * 0.02 * ratio))), 1e-12);
      EXPECT_NEAR(dll_jitter_chips(tracker(Discriminator::DotProduct, d), cn0),
                  std::sqrt(coherent * (1 + 1 / (0.02 * ratio))), 1e-12);
    }
  }
  // Double delta: weights 2 and -1 of nested pairs give twice the variance of early minus late.
  EXPECT_NEAR(dll_jitter_chips(tracker(Discriminator::DoubleDelta, 0.1), 40),
              std::sqrt(2.0) * dll_jitter_chips(tracker(Discriminator::DotProduct, 0.1), 40), 1e-12);
  // 45 dB-Hz, 1 Hz, 1 chip, coherent: 0.0040 chips, 1.2 m.
  EXPECT_NEAR(dll_jitter_m(tracker(Discriminator::Coherent, 1), 45), 1.16, 0.01);
}

// Kaplan & Hegarty, 2nd ed., figure 5.28 c: C/N0 at which sigma is a sixth of a chip (3 sigma half of D = 1
// chip), printed at the curves to 0.1 dB, for a front end of two chip rates, T = 20 ms, 0.2 and 2 Hz. The
// figure is drawn from the approximation 5.23, which is 15 % above the integrals of 5.22 used here.
TEST(DllJitter, ThresholdsOfThePublishedFigure) {
  const double b = 2;
  for (const auto& [loop_hz, cn0] : std::vector<std::pair<double, double>>{{0.2, 12.4}, {2.0, 18.0}}) {
    const double ratio = std::pow(10, cn0 / 10);
    const double approximated = std::sqrt(
        loop_hz / (2 * ratio) * (1 / b + b / (kPi - 1) * std::pow(1 - 1 / b, 2)) * (1 + 2 / (0.02 * ratio)));
    EXPECT_NEAR(approximated, 1.0 / 6, 0.05 / 6);
    const double found =
        dll_jitter_chips(tracker(Discriminator::EarlyLatePower, 1, b, Modulation::BPSK, loop_hz), cn0);
    EXPECT_NEAR(found, 1.0 / 6, 0.16 / 6) << loop_hz;
    EXPECT_LT(found, approximated);
  }
}

// Equation 5.22 with its integrals done numerically over the textbook spectra sinc^2(f) and
// sinc^2(f) tan^2(pi f / 2).
TEST(DllJitter, IsTheGeneralExpression) {
  for (const Modulation modulation : {Modulation::BPSK, Modulation::BOC11}) {
    for (const double b : {2.0, 4.0, 20.0}) {
      for (const double d : modulation == Modulation::BPSK ? std::vector<double>{0.05, 0.2, 0.5, 1}
                                                           : std::vector<double>{0.05, 0.2, 0.5}) {
        double s2 = 0, fs = 0, c2 = 0, c = 0;
        const int n = 20'000;
        const double df = b / n;
        for (int i = 0; i < n; ++i) {
          const double f = (i + 0.5) * df - b / 2;
          const double half = std::sin(kPi * f / 2);
          const double density = modulation == Modulation::BPSK ? std::pow(std::sin(kPi * f) / (kPi * f), 2)
                                                                : std::pow(half * half / (kPi * f / 2), 2);
          s2 += density * std::pow(std::sin(kPi * f * d), 2) * df;
          fs += f * density * std::sin(kPi * f * d) * df;
          c2 += density * std::pow(std::cos(kPi * f * d), 2) * df;
          c += density * std::cos(kPi * f * d) * df;
        }
        const double ratio = 1000;
        const double expected =
            std::sqrt(0.99 / ratio * s2 / std::pow(2 * kPi * fs, 2) * (1 + c2 / (0.02 * ratio * c * c)));
        EXPECT_NEAR(dll_jitter_chips(tracker(Discriminator::EarlyLatePower, d, b, modulation), 30), expected,
                    1e-3 * expected)
            << name(modulation) << ' ' << b << ' ' << d;
      }
    }
  }
}

// As the spacing goes to 0 the coherent loop reaches Bn / (C/N0 (2 pi)^2 integral of f^2 S), the Cramer-Rao
// bound (Betz & Kolodziejski 2009); for BPSK the integral is (B/2 - sin(pi B) / 2 pi) / pi^2.
TEST(DllJitter, NarrowSpacingReachesTheCramerRaoBound) {
  const double b = 10.3;
  const double gabor = (b / 2 - std::sin(kPi * b) / (2 * kPi)) / (kPi * kPi);
  const double expected = std::sqrt(0.99 / 1e4 / (4 * kPi * kPi * gabor));
  EXPECT_NEAR(dll_jitter_chips(tracker(Discriminator::Coherent, 0.005, b), 40), expected, 2e-3 * expected);
  EXPECT_GT(dll_jitter_chips(tracker(Discriminator::Coherent, 0.5, b), 40), expected);
}

/// Standard deviation of a simulated loop: correlators with noise of the covariance by R, the discriminator,
/// a first-order loop of gain k, whose noise bandwidth is k / (2 T (2 - k)).
double simulated_jitter(Discriminator discriminator, double spacing, double cn0_hz, double k, double t,
                        int steps) {
  DllOptions options;
  options.discriminator = discriminator;
  options.spacing_chips = spacing;
  const CorrelatorBank bank = correlator_bank(options);
  const auto count = static_cast<std::size_t>(bank.count);
  std::vector<double> offsets(bank.offset_chips.begin(), bank.offset_chips.begin() + bank.count);
  offsets.push_back(0);  // prompt
  const std::size_t n = offsets.size();
  const auto r = [](double x) { return std::max(0.0, 1 - std::abs(x)); };
  // Cholesky factor of R(o_i - o_k).
  std::vector<std::vector<double>> l(n, std::vector<double>(n, 0));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = r(offsets[i] - offsets[j]);
      for (std::size_t m = 0; m < j; ++m) sum -= l[i][m] * l[j][m];
      l[i][j] = i == j ? std::sqrt(std::max(sum, 0.0)) : l[j][j] > 1e-9 ? sum / l[j][j] : 0;
    }
  }
  RandomStream random(3, name(discriminator));
  const double sigma = std::sqrt(0.5 / (t * cn0_hz));  // of each part of a correlator, signal 1
  const bool power = discriminator == Discriminator::EarlyLatePower;
  const double slope = power ? 4 * (1 - spacing / 2) : 2;
  double x = 0, sum2 = 0;
  std::vector<std::complex<double>> white(n), y(n);
  for (int step = 0; step < steps; ++step) {
    for (auto& each : white) each = {sigma * random.normal(), sigma * random.normal()};
    for (std::size_t i = 0; i < n; ++i) {
      y[i] = r(x + offsets[i]);
      for (std::size_t m = 0; m <= i; ++m) y[i] += l[i][m] * white[m];
    }
    double d = 0;
    if (power) {
      d = std::norm(y[0]) - std::norm(y[1]);
    } else {
      std::complex<double> sum;
      for (std::size_t i = 0; i < count; ++i) sum += bank.weight[i] * y[i];
      d = (sum * std::conj(y[n - 1])).real();
    }
    x -= k * d / slope;
    sum2 += x * x;
  }
  return std::sqrt(sum2 / steps);
}

// The formulas against simulated correlators, at 27 dB-Hz, where the squaring loss is 1.1 in sigma. 400,000
// steps of a memory of 1/k = 25 are 16,000 independent values: sigma to 0.6 %; five of them are 3 %.
TEST(DllJitter, AgreesWithSimulatedCorrelators) {
  const double t = 0.01;
  const double k = 0.04;
  const double loop_hz = k / (2 * t * (2 - k));
  for (const auto& [discriminator, spacing] :
       std::vector<std::pair<Discriminator, double>>{{Discriminator::EarlyLatePower, 0.5},
                                                     {Discriminator::DotProduct, 0.5},
                                                     {Discriminator::DoubleDelta, 0.3}}) {
    const CodeTracker loop = tracker(discriminator, spacing, kInfinite, Modulation::BPSK, loop_hz, t);
    const double expected = dll_jitter_chips(loop, 27);
    const double found = simulated_jitter(discriminator, spacing, std::pow(10, 2.7), k, t, 400'000);
    EXPECT_NEAR(found, expected, 0.03 * expected) << name(discriminator);
  }
}

CodeTracker narrowing_tracker(double narrow_below_dbhz) {
  DllOptions loop;
  loop.narrow_below_dbhz = narrow_below_dbhz;
  return CodeTracker({}, loop);
}

// A scalar Kalman filter of a random walk, run to its steady state: its gain is that of the narrowed loop,
// and half of its variance is from the noise of the observations.
TEST(CodeLoopNoise, NarrowsAsAFilterInItsSteadyState) {
  const CodeLoopNoise fixed(narrowing_tracker(0)), narrow(narrowing_tracker(30));
  const double dt = 1e-4, bandwidth = 1;
  // At 30 dB-Hz the filter has the loop's gain, 4 Bn: q = k^2 N.
  const auto density = [&](double cn0) { return std::pow(fixed.sigma_m(cn0), 2) / (bandwidth * 0.99); };
  // K&H's N is of the one-sided spectrum: Bn N = k / 4 N = k / 2 of N / 2.
  const double q = 16 * density(1000) / 2;
  for (const double cn0 : {1000.0, 100.0, 10.0}) {
    double variance = 1, gain = 0;
    const double noise = density(cn0) / 2;
    for (int i = 0; i < 400'000; ++i) {
      variance += q * dt;
      gain = variance / (variance + noise / dt);
      variance *= 1 - gain;
    }
    const double k = gain / dt;
    EXPECT_NEAR(narrow.bandwidth_ratio(cn0), k / 4, 1e-3 * k) << cn0;
    EXPECT_NEAR(narrow.sigma_m(cn0), std::sqrt(variance / 2), 0.01 * std::sqrt(variance)) << cn0;
  }
}

TEST(CodeLoopNoise, IsFixedAboveItsBoundAndGrowsWithTheFourthRootBelow) {
  const CodeLoopNoise fixed(narrowing_tracker(0)), narrow(narrowing_tracker(30));
  EXPECT_EQ(fixed.bandwidth_ratio(1), 1);
  for (const double cn0 : {1e5, 1e3}) {
    EXPECT_EQ(narrow.bandwidth_ratio(cn0), 1);
    EXPECT_EQ(narrow.sigma_m(cn0), fixed.sigma_m(cn0));
  }
  for (const double cn0 : {100.0, 10.0}) {
    const double ratio = fixed.sigma_m(cn0) / fixed.sigma_m(1e3);  // root of the variances'
    EXPECT_NEAR(narrow.bandwidth_ratio(cn0), 1 / ratio, 1e-12);
    // Within Bn T / 2, which is smaller for the narrower loop.
    EXPECT_NEAR(narrow.sigma_m(cn0) / narrow.sigma_m(1e3), std::sqrt(ratio), 0.006 * std::sqrt(ratio));
  }
}

TEST(PllJitter, ClosedForm) {
  // Bn = 10 Hz, T = 20 ms, 30 dB-Hz: sqrt(10 / 1000 (1 + 1 / 40)) = 0.101242 rad = 5.80 degrees.
  EXPECT_NEAR(pll_jitter_rad({10, 0.02}, 30), 0.1012423, 1e-7);
  // Without squaring loss at 60 dB-Hz: sqrt(Bn N0/C).
  EXPECT_NEAR(pll_jitter_rad({10, 0.02}, 60), std::sqrt(1e-5), 1e-7);
}

// An arctangent discriminator on a prompt correlator with noise, first-order loop: as for the code.
TEST(PllJitter, AgreesWithASimulatedLoop) {
  const double t = 0.02;
  const double k = 0.04;
  const double loop_hz = k / (2 * t * (2 - k));
  const double ratio = std::pow(10, 3.0);
  RandomStream random(11, "pll");
  const double sigma = std::sqrt(0.5 / (t * ratio));
  double phase = 0, sum2 = 0;
  const int steps = 400'000;
  for (int i = 0; i < steps; ++i) {
    const double in_phase = std::cos(phase) + sigma * random.normal();
    const double quadrature = std::sin(phase) + sigma * random.normal();
    phase -= k * std::atan(quadrature / in_phase);
    sum2 += phase * phase;
  }
  const double expected = pll_jitter_rad({loop_hz, t}, 30);
  EXPECT_NEAR(std::sqrt(sum2 / steps), expected, 0.04 * expected);
}

TEST(FllJitter, ClosedForm) {
  // Bn = 5 Hz, T = 20 ms, 30 dB-Hz, F = 1: sqrt(0.02 * 1.05) / (2 pi 0.02) = 1.15319 Hz.
  EXPECT_NEAR(fll_jitter_hz({5, 0.02}, 30), 1.15319, 1e-5);
}

TEST(LoopNoise, HasDeviationAndCorrelationAtAnyRate) {
  // Statistics of 200,000 samples; five sigma of each estimator, with the effective number of independent
  // samples n (1 - a^2) / (1 + a^2) for squares of a first-order process of step correlation a.
  for (const double dt : {0.02, 0.1, 1.0}) {
    LoopNoise noise(0.5, RandomStream(5, "loop"));
    const int n = 200'000;
    std::vector<double> x(n);
    for (double& each : x) each = noise.advance(dt, 3);
    double sum2 = 0, lagged = 0;
    for (int i = 0; i < n; ++i) {
      sum2 += x[static_cast<std::size_t>(i)] * x[static_cast<std::size_t>(i)];
      if (i > 0) lagged += x[static_cast<std::size_t>(i)] * x[static_cast<std::size_t>(i) - 1];
    }
    const double a = std::exp(-4 * 0.5 * dt);
    const double effective = n * (1 - a * a) / (1 + a * a);
    const double bound = 5 * std::sqrt(2 / effective);
    EXPECT_NEAR(sum2 / n / 9, 1, bound) << dt;
    EXPECT_NEAR(lagged / sum2, a, 5 * std::sqrt((1 - a * a) / n)) << dt;
  }
}

TEST(LoopNoise, ScalesWithSigma) {
  LoopNoise a(1, RandomStream(5, "loop"));
  LoopNoise b(1, RandomStream(5, "loop"));
  for (int i = 0; i < 10; ++i) EXPECT_NEAR(a.advance(0.1, 2), 4 * b.advance(0.1, 0.5), 1e-15);
  const double now = a.advance(0, 1);
  EXPECT_EQ(a.advance(0, 1), now);
  EXPECT_EQ(a.advance(1, 0), 0);
}

TEST(LoopNoise, RefusesBadInput) {
  EXPECT_THROW(LoopNoise(0, RandomStream(1, "x")), InputError);
  EXPECT_THROW(LoopNoise(kInfinite, RandomStream(1, "x")), InputError);
  LoopNoise noise(1, RandomStream(1, "x"));
  EXPECT_THROW((void)noise.advance(-1, 1), InputError);
  EXPECT_THROW((void)noise.advance(1, -1), InputError);
  EXPECT_THROW((void)noise.advance(1, std::nan("")), InputError);
  EXPECT_THROW((void)cn0_hz(std::nan("")), InputError);
  EXPECT_THROW((PllOptions{0, 0.02}.validate()), InputError);
  EXPECT_THROW((PllOptions{30, 0.02}.validate()), InputError);
  EXPECT_THROW((FllOptions{5, 0}.validate()), InputError);
}

}  // namespace
}  // namespace canyon::tracking::loop_noise_test
