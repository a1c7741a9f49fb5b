#include "canyon/receiver/tracking/code_tracking.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/receiver/tracking/noise.hpp"

namespace canyon::tracking {
namespace {

using geodesy::kPi;

constexpr double kInfinite = std::numeric_limits<double>::infinity();
const std::vector<Discriminator> kEarlyLate{Discriminator::Coherent, Discriminator::EarlyLatePower,
                                            Discriminator::DotProduct};
const std::vector<Discriminator> kAll{Discriminator::Coherent, Discriminator::EarlyLatePower,
                                      Discriminator::DotProduct, Discriminator::DoubleDelta};

CodeTracker tracker(Modulation modulation, Discriminator discriminator, double spacing,
                    double bandwidth_hz = kInfinite) {
  CorrelationOptions signal;
  signal.modulation = modulation;
  signal.bandwidth_hz = bandwidth_hz;
  DllOptions loop;
  loop.discriminator = discriminator;
  loop.spacing_chips = spacing;
  return CodeTracker(signal, loop);
}

/// Code error [chips] of a direct path and one reflection of relative amplitude `alpha` (negative: antiphase)
/// delayed by `delay` chips; the loop has tracked the direct path.
double error_chips(const CodeTracker& tracker, double alpha, double delay) {
  const double chip = tracker.correlation().chip_m();
  const std::vector<SignalPath> paths{{0, {1, 0}, 0}, {delay * chip, {alpha, 0}, 0}};
  const auto lock = tracker.lock(paths, 0.0);
  EXPECT_TRUE(lock) << alpha << ' ' << delay;
  return lock ? lock->delay_m / chip : std::nan("");
}

/// Envelope of early minus late, infinite bandwidth, BPSK: with R = 1 - |tau| the discriminator of one path
/// is 2 tau to half the spacing d, d to 1 - d/2, and falls to 0 at 1 + d/2. Its zero with two paths,
/// piecewise (the trapezoid of the textbooks, its height alpha d / 2):
///   alpha delay / (1 + alpha)                        to delay = (1 + alpha) d / 2
///   alpha d / 2                                      to delay = 1 - d / 2 + alpha d / 2
///   alpha (1 + d / 2 - delay) / (2 - alpha)          to delay = 1 + d / 2; then 0
/// alpha < 0 for antiphase. Valid for coherent, dot product and power discriminators, since E + L and P keep
/// their sign.
double early_late_envelope(double alpha, double d, double delay) {
  if (delay <= (1 + alpha) * d / 2) return alpha * delay / (1 + alpha);
  if (delay <= 1 - d / 2 + alpha * d / 2) return alpha * d / 2;
  if (delay <= 1 + d / 2) return alpha * (1 + d / 2 - delay) / (2 - alpha);
  return 0;
}

/// The same for 2 (E1 - L1) - (E2 - L2): one path gives 2 tau to d/2, 2 d - 2 tau to d, nothing to 1 - d.
double double_delta_envelope(double alpha, double d, double delay) {
  if (delay <= (1 + alpha) * d / 2) return alpha * delay / (1 + alpha);
  if (delay <= d) return alpha * (d - delay) / (1 - alpha);
  return 0;  // to 1 - d
}

TEST(CodeTracker, EarlyLateEnvelopeOfBpsk) {
  double worst = 0;
  for (const Discriminator discriminator : kEarlyLate) {
    for (const double d : {1.0, 0.5, 0.1}) {
      const CodeTracker loop = tracker(Modulation::BPSK, discriminator, d);
      for (const double alpha : {0.1, 0.5, 0.9, -0.1, -0.5, -0.9}) {
        double largest = 0;
        for (int i = 0; i <= 1600; ++i) {
          const double delay = i * 0.001;
          const double error = error_chips(loop, alpha, delay);
          const double expected = early_late_envelope(alpha, d, delay);
          EXPECT_NEAR(error, expected, 1e-8)
              << name(discriminator) << ' ' << d << ' ' << alpha << ' ' << delay;
          worst = std::max(worst, std::abs(error - expected));
          largest = std::max(largest, std::abs(error));
        }
        // The value in every textbook: alpha d / 2.
        EXPECT_NEAR(largest, std::abs(alpha) * d / 2, 1e-8);
      }
    }
  }
  RecordProperty("worst_chips", std::to_string(worst * 1e12) + "e-12");
}

TEST(CodeTracker, MaximaInMetres) {
  // alpha = 1/2 at 1.023 Mchip/s: 73.26, 36.63 and 7.33 m, by alpha d / 2 times 293.05 m.
  const std::vector<std::pair<double, double>> maxima{{1, 73.263}, {0.5, 36.632}, {0.1, 7.3263}};
  for (const auto& [d, expected] : maxima) {
    const CodeTracker loop = tracker(Modulation::BPSK, Discriminator::DotProduct, d);
    double largest = 0;
    for (double delay = 0; delay < 1.6; delay += 0.005) {
      largest = std::max(largest, error_chips(loop, 0.5, delay) * loop.correlation().chip_m());
    }
    EXPECT_NEAR(largest, expected, 1e-3);
  }
}

TEST(CodeTracker, FasterChipsErrLess) {
  // alpha d / 2 chips of c / 10.23e6 = 29.305 m: 7.326 m with d = 1; B1I: 36.63 m.
  for (const auto& [rate, expected] :
       std::vector<std::pair<double, double>>{{10.23e6, 7.3263}, {2.046e6, 36.632}}) {
    CorrelationOptions signal;
    signal.chip_rate_hz = rate;
    DllOptions loop;
    loop.spacing_chips = 1;
    EXPECT_NEAR(error_chips(CodeTracker(signal, loop), 0.5, 0.75) * Correlation(signal).chip_m(), expected,
                1e-3);
  }
}

TEST(CodeTracker, DoubleDeltaEnvelopeOfBpsk) {
  for (const double d : {0.2, 0.1}) {
    const CodeTracker loop = tracker(Modulation::BPSK, Discriminator::DoubleDelta, d);
    for (const double alpha : {0.1, 0.5, 0.8, -0.1, -0.5, -0.8}) {
      for (int i = 0; i <= 1000; ++i) {
        const double delay = i * (1 - 2 * d) / 1000;
        EXPECT_NEAR(error_chips(loop, alpha, delay), double_delta_envelope(alpha, d, delay), 1e-8)
            << d << ' ' << alpha << ' ' << delay;
      }
      // Around a chip the corner at the foot of R appears again, with a quarter of the spacing.
      double foot = 0;
      for (double delay = 1 - 2 * d; delay < 1 + 2 * d; delay += 0.0005) {
        foot = std::max(foot, std::abs(error_chips(loop, alpha, delay)));
      }
      EXPECT_NEAR(foot, std::abs(alpha) * d / 4, 2e-4);
    }
  }
}

TEST(CodeTracker, EarlyLateEnvelopeOfBoc11) {
  // R falls by 3 per chip to half a chip and rises by 1 to the next: alpha d / 2 as for BPSK to
  // delay = 1/2 - d/2 + alpha d/2, and the other sign with a third, -alpha d / 6, on the outer slope.
  const double d = 0.1;
  for (const Discriminator discriminator : kEarlyLate) {
    const CodeTracker loop = tracker(Modulation::BOC11, discriminator, d);
    for (const double alpha : {0.1, 0.5, -0.1, -0.5}) {
      for (const double delay : {0.001, 0.01, 0.02}) {
        EXPECT_NEAR(error_chips(loop, alpha, delay), alpha * delay / (1 + alpha), 1e-8);
      }
      for (const double delay : {0.1, 0.2, 0.3, 0.4}) {
        EXPECT_NEAR(error_chips(loop, alpha, delay), alpha * d / 2, 1e-8) << name(discriminator);
      }
      for (const double delay : {0.6, 0.7, 0.8, 0.9}) {
        EXPECT_NEAR(error_chips(loop, alpha, delay), -alpha * d / 6, 1e-8) << name(discriminator);
      }
      double largest = 0;
      for (double delay = 0; delay < 1.2; delay += 0.001) {
        largest = std::max(largest, std::abs(error_chips(loop, alpha, delay)));
      }
      EXPECT_NEAR(largest, std::abs(alpha) * d / 2, 1e-8);
      EXPECT_NEAR(error_chips(loop, alpha, 1 + d), 0, 1e-9);
    }
  }
}

/// Largest error in metres over delays and both signs of a reflection at half the direct amplitude.
double maximum_m(const CodeTracker& loop) {
  double largest = 0;
  for (int i = 0; i <= 300; ++i) {
    for (const double alpha : {0.5, -0.5}) {
      largest = std::max(largest, std::abs(error_chips(loop, alpha, i * 0.005)));
    }
  }
  return largest * loop.correlation().chip_m();
}

// The table of docs/tracking.md. With infinite bandwidth alpha d / 2; the others were computed once by a
// separate Python program: R by the midpoint rule over the spectrum, 1500 frequencies, delays every 0.005
// chips, the zero by steps of 0.002 chips and bisection.
TEST(CodeTracker, MaximaOfTheDocumentation) {
  struct Row {
    Modulation modulation;
    Discriminator discriminator;
    double spacing, bandwidth_hz, maximum_m;
  };
  const Discriminator power = Discriminator::EarlyLatePower;
  const Discriminator delta = Discriminator::DoubleDelta;
  const std::vector<Row> rows{
      {Modulation::BPSK, power, 1, kInfinite, 73.263},   {Modulation::BPSK, power, 1, 2.046e6, 54.290},
      {Modulation::BPSK, power, 0.5, kInfinite, 36.632}, {Modulation::BPSK, power, 0.5, 4e6, 33.311},
      {Modulation::BPSK, power, 0.1, kInfinite, 7.326},  {Modulation::BPSK, power, 0.1, 4e6, 23.221},
      {Modulation::BPSK, power, 0.1, 8e6, 11.941},       {Modulation::BPSK, power, 0.1, 24e6, 6.918},
      {Modulation::BPSK, delta, 0.1, kInfinite, 7.326},  {Modulation::BPSK, delta, 0.1, 24e6, 4.640},
      {Modulation::BOC11, power, 0.1, kInfinite, 7.326}, {Modulation::BOC11, power, 0.1, 24e6, 6.933},
      {Modulation::CBOCPilot, power, 0.1, 24e6, 5.066},
  };
  for (const Row& row : rows) {
    const double found = maximum_m(tracker(row.modulation, row.discriminator, row.spacing, row.bandwidth_hz));
    EXPECT_NEAR(found, row.maximum_m, 0.01) << name(row.modulation) << ' ' << name(row.discriminator) << ' '
                                            << row.spacing << ' ' << row.bandwidth_hz;
  }
}

// Eissfeller et al. 2007, as quoted by J. Space Weather Space Clim. 3, 2013, article swsc120015, table 1:
// largest code errors of a narrow correlator, C/A in 8 MHz 12.0 m, BOC(1,1) in 24 MHz 6.9 m, CBOC in 24
// MHz 5.2 m.
TEST(CodeTracker, MaximaOfPublishedEnvelopes) {
  const Discriminator power = Discriminator::EarlyLatePower;
  EXPECT_NEAR(maximum_m(tracker(Modulation::BPSK, power, 0.1, 8e6)), 12.0, 0.1);
  EXPECT_NEAR(maximum_m(tracker(Modulation::BOC11, power, 0.1, 24e6)), 6.9, 0.1);
  EXPECT_NEAR(maximum_m(tracker(Modulation::CBOCPilot, power, 0.1, 24e6)), 5.2, 0.15);
}

TEST(CodeTracker, OnePathHasNoError) {
  for (const Modulation modulation : {Modulation::BPSK, Modulation::BOC11, Modulation::CBOCPilot}) {
    for (const Discriminator discriminator : kAll) {
      for (const double bandwidth : {kInfinite, 4e6, 24e6}) {
        const CodeTracker loop = tracker(modulation, discriminator, 0.1, bandwidth);
        for (const double delay : {0.0, 81.7, 400.0, 5'000.0}) {
          const std::vector<SignalPath> paths{{delay, std::polar(3e-8, 2.0), 0}};
          for (const double prior : {delay, delay + 2, delay - 2}) {
            const auto lock = loop.lock(paths, prior);
            ASSERT_TRUE(lock);
            EXPECT_NEAR(lock->delay_m, delay, 1e-6);
            EXPECT_NEAR(std::arg(lock->prompt), 2, 1e-9);
            EXPECT_NEAR(lock->prompt_power, 9e-16 * std::pow(loop.correlation().value(0), 2), 1e-20);
          }
          const auto fresh = loop.lock(paths);
          ASSERT_TRUE(fresh);
          EXPECT_NEAR(fresh->delay_m, delay, 1e-6);
        }
      }
    }
  }
}

TEST(CodeTracker, InvariantToShiftScaleAndPhase) {
  RandomStream random(4, "paths");
  for (const Discriminator discriminator : kAll) {
    const CodeTracker loop = tracker(Modulation::BPSK, discriminator, 0.3, 8e6);
    for (int k = 0; k < 50; ++k) {
      std::vector<SignalPath> paths{{0, {1, 0}, 0}};
      std::vector<SignalPath> moved{{70, std::polar(0.01, 1.0), 0}};
      for (int i = 0; i < 3; ++i) {
        const double delay = 300 * random.uniform();
        const double size = 0.4 * random.uniform();
        const double phase = 6 * random.uniform();
        paths.push_back({delay, std::polar(size, phase), 3 * random.uniform()});
        moved.push_back({delay + 70, std::polar(0.01 * size, phase + 1), paths.back().fading_hz});
      }
      const auto a = loop.lock(paths, 0.0);
      const auto b = loop.lock(moved, 70.0);
      ASSERT_EQ(a.has_value(), b.has_value());
      if (!a) continue;
      EXPECT_NEAR(b->delay_m, a->delay_m + 70, 1e-6);
    }
  }
}

TEST(CodeTracker, TracksReflectionsWithoutADirectPath) {
  const CodeTracker loop = tracker(Modulation::BPSK, Discriminator::EarlyLatePower, 0.5);
  const std::vector<SignalPath> one{{150, {0.2, 0.1}, 0}};
  EXPECT_NEAR(loop.lock(one)->delay_m, 150, 1e-6);
  // The loop was on the direct path before it was blocked: half a chip away it is pulled over.
  EXPECT_NEAR(loop.lock(one, 0.0)->delay_m, 150, 1e-6);
  // More than one and a quarter chips away it has no pull, and the signal is acquired again.
  const std::vector<SignalPath> far{{500, {0.2, 0.1}, 0}};
  EXPECT_NEAR(loop.lock(far, 0.0)->delay_m, 500, 1e-6);
  // The loop acquires the stronger of two echoes far apart, and keeps the tracked one.
  const std::vector<SignalPath> two{{100, {0.3, 0}, 0}, {700, {0, 0.5}, 0}};
  EXPECT_NEAR(loop.lock(two)->delay_m, 700, 1e-6);
  EXPECT_NEAR(loop.lock(two, 110.0)->delay_m, 100, 1e-6);
  // Locks are kept from a thousandth of the strongest one's power on: amplitudes 0.0316 of it.
  const auto weak = [&](double amplitude) {
    const std::vector<SignalPath> paths{{0, {1, 0}, 0}, {1500, {amplitude, 0}, 0}};
    return loop.lock(paths, 1500.0)->delay_m;
  };
  EXPECT_NEAR(weak(0.032), 1500, 1e-6);
  EXPECT_NEAR(weak(0.031), 0, 1e-6);
  // The first of two equal paths wins.
  const std::vector<SignalPath> equals{{700, {0.5, 0}, 0}, {100, {0, 0.5}, 0}};
  EXPECT_NEAR(loop.lock(equals)->delay_m, 100, 1e-6);
}

TEST(CodeTracker, KeepsASideLobeOfBoc) {
  // |R| has side peaks half a chip out, with slopes 3 and -1 there: E and L are equal at 1/2 + d/4.
  const double d = 0.1;
  const CodeTracker loop = tracker(Modulation::BOC11, Discriminator::EarlyLatePower, d);
  const double chip = loop.correlation().chip_m();
  const std::vector<SignalPath> direct{{0, {1, 0}, 0}};
  EXPECT_NEAR(loop.lock(direct, 0.52 * chip)->delay_m / chip, 0.5 + d / 4, 1e-8);
  EXPECT_NEAR(loop.lock(direct, -0.52 * chip)->delay_m / chip, -0.5 - d / 4, 1e-8);
  EXPECT_NEAR(loop.lock(direct)->delay_m, 0, 1e-6);
}

TEST(CodeTracker, DoubleDeltaWithoutPullIsFoundAnew) {
  const CodeTracker loop = tracker(Modulation::BPSK, Discriminator::DoubleDelta, 0.1);
  const std::vector<SignalPath> direct{{0, {1, 0}, 0}};
  // Between d and 1 - d the discriminator is exactly flat.
  EXPECT_NEAR(loop.discriminator(150, direct), 0, 1e-14);
  EXPECT_NEAR(loop.lock(direct, 150.0)->delay_m, 0, 1e-6);
}

TEST(CodeTracker, FastFadingLeavesTheSumOfPowers) {
  // |E|^2 - |L|^2 of one path, BPSK: 4 tau (1 - d/2) near 0, -2 d (1 - x) at tau = -x on the slope; the zero
  // of the sum with weight alpha^2 is alpha^2 d (1 - delay) / (2 - d - alpha^2 d).
  CorrelationOptions signal;
  DllOptions options;
  options.spacing_chips = 0.4;
  options.integration_s = 0.001;
  options.loop_bandwidth_hz = 0.001;
  const CodeTracker loop(signal, options);
  const double chip = loop.correlation().chip_m();
  for (const double fading : {50.0, -300.0}) {
    const double x = kPi * fading * options.integration_s;
    const double alpha = 0.7;
    const double kept = alpha * std::sin(x) / x;
    const std::vector<SignalPath> paths{{0, {1, 0}, 0}, {0.5 * chip, {0, alpha}, fading}};
    const double d = options.spacing_chips;
    const double expected = kept * kept * d * 0.5 / (2 - d - kept * kept * d);
    EXPECT_NEAR(loop.lock(paths, 0.0)->delay_m / chip, expected, 1e-5);
  }
}

TEST(CodeTracker, FadingAtOneOverTLeavesNothing) {
  const CodeTracker loop = tracker(Modulation::BPSK, Discriminator::DotProduct, 0.5);
  const std::vector<SignalPath> paths{{0, {1, 0}, 0}, {60, {0.9, 0}, 1 / loop.options().integration_s}};
  EXPECT_NEAR(loop.lock(paths, 0.0)->delay_m, 0, 1e-6);
}

TEST(CodeTracker, SlowFadingIsFilteredByTheLoop) {
  // A small reflection moves the code by alpha d / 2 cos(phase); a first-order loop of bandwidth Bn passes
  // an oscillation of frequency f with 1 / sqrt(1 + (pi f / 2 Bn)^2).
  const CodeTracker loop = tracker(Modulation::BPSK, Discriminator::DotProduct, 0.5);
  const double chip = loop.correlation().chip_m();
  const double alpha = 1e-3;
  for (const double f : {0.0, 0.1, 0.5, 1.0, 3.0}) {
    const std::vector<SignalPath> paths{{0, {1, 0}, 0}, {0.5 * chip, {alpha, 0}, f}};
    const double x = kPi * f * loop.options().integration_s;
    const double passed = (f == 0 ? 1 : std::sin(x) / x) / std::hypot(1, kPi * f / 2);
    EXPECT_NEAR(loop.lock(paths, 0.0)->delay_m / chip, alpha * 0.25 * passed, 2e-6);
  }
}

// The same filter in the time domain, independent of the formula: a first-order loop, stepped every
// millisecond, follows the dot product of a direct path and a rotating one; the mean power of its oscillation
// equals that of frozen phases with fading_hz set.
TEST(CodeTracker, FadingAgreesWithASteppedLoop) {
  const CodeTracker loop = tracker(Modulation::BPSK, Discriminator::DotProduct, 0.5);
  const double chip = loop.correlation().chip_m();
  const double alpha = 0.2;
  const double delay = 0.5 * chip;
  for (const double f : {0.2, 1.0, 5.0}) {
    const double dt = 0.001;
    const double w = 4 * loop.options().loop_bandwidth_hz;
    double x = 0;
    double sum = 0, sum2 = 0;
    int n = 0;
    for (double t = 0; t < 40; t += dt) {
      const std::vector<SignalPath> now{{0, {1, 0}, 0}, {delay, std::polar(alpha, 2 * kPi * f * t), 0}};
      x -= w * dt * loop.discriminator(x, now) / (2 / chip);  // slope of D: 2 per chip
      if (t < 10) continue;
      sum += x;
      sum2 += x * x;
      ++n;
    }
    const double mean = sum / n;
    const double deviation = std::sqrt(sum2 / n - mean * mean);
    double frozen = 0, frozen2 = 0;
    const int phases = 64;
    for (int k = 0; k < phases; ++k) {
      const std::vector<SignalPath> paths{{0, {1, 0}, 0},
                                          {delay, std::polar(alpha, 2 * kPi * k / phases), f}};
      const double y = loop.lock(paths, 0.0)->delay_m;
      frozen += y / phases;
      frozen2 += y * y / phases;
    }
    const double expected = std::sqrt(frozen2 - frozen * frozen);
    EXPECT_NEAR(expected, deviation, 0.05 * deviation) << f;
    EXPECT_NEAR(frozen, mean, 0.05 * deviation + 0.15) << f;
  }
}

TEST(CodeTracker, PhasesStayInsideTheEnvelope) {
  for (const Discriminator discriminator : kAll) {
    const CodeTracker loop = tracker(Modulation::BPSK, discriminator, 0.1);
    const double chip = loop.correlation().chip_m();
    for (double delay = 0.02; delay < 1.2; delay += 0.02) {
      for (double phase = 0; phase < 2 * kPi; phase += 0.1) {
        const std::vector<SignalPath> paths{{0, {1, 0}, 0}, {delay * chip, std::polar(0.5, phase), 0}};
        EXPECT_LE(std::abs(loop.lock(paths, 0.0)->delay_m / chip), 0.5 * 0.1 / 2 + 1e-9)
            << name(discriminator) << ' ' << delay << ' ' << phase;
      }
    }
  }
}

// For any paths the result is a stable zero within their reach, and the same each time.
TEST(CodeTracker, RandomPathsGiveStableZeros) {
  std::vector<CodeTracker> loops;
  for (const Modulation modulation : {Modulation::BPSK, Modulation::BOC11, Modulation::CBOCPilot}) {
    for (const Discriminator discriminator : kAll) {
      for (const double bandwidth : {kInfinite, 4e6, 20e6}) {
        for (const double spacing : {0.03, 0.1}) {
          loops.push_back(tracker(modulation, discriminator, spacing, bandwidth));
        }
      }
    }
  }
  RandomStream random(9, "random paths");
  int locked = 0;
  for (int k = 0; k < 4'000; ++k) {
    const CodeTracker& loop = loops[static_cast<std::size_t>(k) % loops.size()];
    const double chip = loop.correlation().chip_m();
    std::vector<SignalPath> paths(1 + static_cast<std::size_t>(random.uniform() * (k % 50 == 0 ? 120 : 6)));
    double least = kInfinite, maximum = 0, amplitude = 0;
    for (SignalPath& path : paths) {
      path.delay_m = 600 * random.uniform();
      path.amplitude = std::polar(random.uniform(), 2 * kPi * random.uniform());
      path.fading_hz = random.normal();
      least = std::min(least, path.delay_m);
      maximum = std::max(maximum, path.delay_m);
      amplitude += std::abs(path.amplitude);
    }
    std::optional<double> prior;
    if (random.uniform() < 0.5) prior = 800 * random.uniform() - 100;
    const auto lock = loop.lock(paths, prior);
    if (!lock) continue;
    ++locked;
    EXPECT_GE(lock->delay_m, least - chip);
    EXPECT_LE(lock->delay_m, maximum + chip);
    EXPECT_GT(lock->prompt_power, 0);
    const double h = 1e-7 * chip;
    const double rounding = 1e-14 * amplitude * amplitude;
    EXPECT_LE(loop.discriminator(lock->delay_m - h, paths), rounding);
    EXPECT_GE(loop.discriminator(lock->delay_m + h, paths), -rounding);
    // Once locked, it stays.
    const auto again = loop.lock(paths, lock->delay_m);
    ASSERT_TRUE(again);
    EXPECT_NEAR(again->delay_m, lock->delay_m, 1e-8 * chip) << k;
  }
  EXPECT_GT(locked, 3'900);
  RecordProperty("locked", locked);
}

TEST(CodeTracker, NoAnswerWithoutPower) {
  const CodeTracker loop = tracker(Modulation::BPSK, Discriminator::EarlyLatePower, 0.5);
  EXPECT_FALSE(loop.lock({}));
  EXPECT_FALSE(loop.lock(std::vector<SignalPath>{{10, {0, 0}, 0}}, 0.0));
  // Two equal paths in antiphase at one delay.
  EXPECT_FALSE(loop.lock(std::vector<SignalPath>{{0, {1, 0}, 0}, {0, {-1, 0}, 0}}, 0.0));
}

TEST(CodeTracker, RefusesBadInput) {
  const CodeTracker loop = tracker(Modulation::BPSK, Discriminator::EarlyLatePower, 0.5);
  const double nan = std::nan("");
  EXPECT_THROW((void)loop.lock(std::vector<SignalPath>{{nan, {1, 0}, 0}}), InputError);
  EXPECT_THROW((void)loop.lock(std::vector<SignalPath>{{0, {1, nan}, 0}}), InputError);
  EXPECT_THROW((void)loop.lock(std::vector<SignalPath>{{0, {1, 0}, kInfinite}}), InputError);
  EXPECT_THROW((void)loop.lock(std::vector<SignalPath>{{0, {1, 0}, 0}}, nan), InputError);
  EXPECT_THROW((void)loop.discriminator(nan, {}), InputError);
  EXPECT_THROW(tracker(Modulation::BPSK, Discriminator::EarlyLatePower, 0), InputError);
  EXPECT_THROW(tracker(Modulation::BPSK, Discriminator::EarlyLatePower, 1.01), InputError);
  EXPECT_THROW(tracker(Modulation::BPSK, Discriminator::DoubleDelta, 0.6), InputError);
  // A chip apart, the correlators are on the side peaks of |BOC(1,1)|.
  EXPECT_THROW(tracker(Modulation::BOC11, Discriminator::EarlyLatePower, 1), InputError);
  DllOptions options;
  options.loop_bandwidth_hz = 30;
  options.integration_s = 0.02;
  EXPECT_THROW(options.validate(), InputError);
  options = {};
  options.integration_s = nan;
  EXPECT_THROW(options.validate(), InputError);
}

}  // namespace
}  // namespace canyon::tracking
