// Motion of a code loop between epochs (CodeTracker::follow()).
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/receiver/tracking/code_tracking.hpp"

namespace canyon::tracking {
namespace {

using geodesy::kPi;

constexpr double kStrong_hz = 1e5;  // 50 dB-Hz

CodeTracker tracker(Modulation modulation = Modulation::BPSK, double bandwidth_hz = 1, double spacing = 0.5,
                    double front_end_hz = std::numeric_limits<double>::infinity(), double check_s = 1) {
  CorrelationOptions signal;
  signal.modulation = modulation;
  signal.bandwidth_hz = front_end_hz;
  DllOptions loop;
  loop.spacing_chips = spacing;
  loop.loop_bandwidth_hz = bandwidth_hz;
  loop.peak_check_s = check_s;
  return CodeTracker(signal, loop);
}

/// Follows in steps of `step_s`; `time_s` is the total time.
CodeLoopState followed(const CodeTracker& tracker, CodeLoopState state, const std::vector<SignalPath>& paths,
                       double time_s, double step_s, double cn0_hz = kStrong_hz) {
  const int steps = static_cast<int>(std::lround(time_s / step_s));
  for (int i = 0; i < steps; ++i) {
    EXPECT_TRUE(tracker.follow(state, paths, step_s, cn0_hz));
  }
  return state;
}

TEST(CodeLoop, WithAShareOfItsBandwidthIsALoopOfThatBandwidth) {
  const CodeTracker wide = tracker(Modulation::BPSK, 2), narrow = tracker(Modulation::BPSK, 0.5);
  const std::vector<SignalPath> paths{{0, {1, 0}}, {40, {0.3, 0.2}, 0.05}};
  CodeLoopState wide_loop{30}, narrow_loop{30};
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(wide.follow(wide_loop, paths, 0.1, kStrong_hz, 0.25));
    EXPECT_TRUE(narrow.follow(narrow_loop, paths, 0.1, kStrong_hz));
    EXPECT_NEAR(wide_loop.delay_m, narrow_loop.delay_m, 1e-9);
  }
  EXPECT_LT(wide_loop.delay_m, 25);
  EXPECT_THROW((void)wide.follow(wide_loop, paths, 0.1, kStrong_hz, 0), InputError);
  EXPECT_THROW((void)wide.follow(wide_loop, paths, 0.1, kStrong_hz, 1.5), InputError);
}

/// Powers of early and late with R = 1 - |tau|, both correlators on their side of the peak, h = 1 - d/2:
/// e = h^2 tau / (h^2 + tau^2), so that d(tau)/dt = -k e has h^2 ln(tau) + tau^2 / 2 = C - k h^2 t.
TEST(CodeLoop, PullsInAsTheClosedFormOfItsDifferentialEquation) {
  for (const double bandwidth : {0.25, 1.0, 2.0}) {
    const CodeTracker loop = tracker(Modulation::BPSK, bandwidth);
    const double chip = loop.correlation().chip_m();
    const double h = 1 - 0.25, start = 0.24, k = 4 * bandwidth;
    CodeLoopState state{start * chip, 0, 0};
    const std::vector<SignalPath> paths{{0, {1, 0}}};
    for (int i = 1; i <= 10; ++i) {
      state = followed(loop, state, paths, 0.1 / bandwidth, 0.1 / bandwidth);
      const double tau = state.delay_m / chip;
      const double passed = (h * h * std::log(start / tau) + (start * start - tau * tau) / 2) / (k * h * h);
      // Steps keep e constant for at most a quarter of a time constant, which matters while e is nonlinear.
      EXPECT_NEAR(passed, 0.1 * i / bandwidth, 0.003 * i / bandwidth) << bandwidth;
    }
  }
}

TEST(CodeLoop, NeedsItsTimeConstantForASmallStep) {
  // tau = tau_0 e^(-4 Bn t), exact where e is linear.
  const CodeTracker loop = tracker();
  const std::vector<SignalPath> paths{{0, {1, 0}}};
  const CodeLoopState after = followed(loop, {1, 0, 0}, paths, 0.5, 0.5);
  EXPECT_NEAR(after.delay_m, std::exp(-4 * 0.5), 1e-4);
}

TEST(CodeLoop, GoesTheSameWayAtEveryRateOfEpochs) {
  const CodeTracker loop = tracker();
  const std::vector<SignalPath> paths{{60, {0.8, 0.1}}, {130, {0.3, 0.4}}};
  const double once = followed(loop, {0, 0, 0}, paths, 2, 2).delay_m;
  EXPECT_GT(once, 40);
  for (const double step : {1.0, 0.2, 0.1, 0.02, 0.005}) {
    EXPECT_NEAR(followed(loop, {0, 0, 0}, paths, 2, step).delay_m, once, 0.01 * once) << step;
  }
}

TEST(CodeLoop, SettlesWhereTheEnvelopeSays) {
  for (const Discriminator discriminator : {Discriminator::Coherent, Discriminator::EarlyLatePower,
                                            Discriminator::DotProduct, Discriminator::DoubleDelta}) {
    DllOptions options;
    options.discriminator = discriminator;
    options.spacing_chips = 0.2;
    const CodeTracker loop(CorrelationOptions{}, options);
    for (const double delay_m : {5.0, 20.0, 90.0, 280.0}) {
      for (const double alpha : {0.5, -0.5}) {
        const std::vector<SignalPath> paths{{0, {1, 0}}, {delay_m, {alpha, 0}}};
        const double rest = loop.lock(paths, 0.0)->delay_m;
        EXPECT_NEAR(followed(loop, {0, 0, 0}, paths, 20, 1).delay_m, rest, 1e-3)
            << name(discriminator) << ' ' << delay_m << ' ' << alpha;
      }
    }
  }
}

TEST(CodeLoop, PassesSlowFadingAndFiltersFastOne) {
  // A weak reflection on both slopes of the replica: e = -a delay cos(phase) to first order, through k / (s +
  // k): amplitude falls with 1 / sqrt(1 + (2 pi f / k)^2).
  const CodeTracker loop = tracker(Modulation::BPSK, 1);
  const double delay_m = 20, a = 0.02;
  for (const double f : {0.05, 0.64, 3.0}) {
    CodeLoopState state{0, 0, 0};
    double square = 0;
    int count = 0;
    const double step = 0.1;
    for (int i = 1; i <= 600; ++i) {
      const std::vector<SignalPath> paths{{0, {1, 0}}, {delay_m, std::polar(a, 2 * kPi * f * i * step), f}};
      ASSERT_TRUE(loop.follow(state, paths, step, kStrong_hz));
      if (i <= 100) continue;
      square += state.delay_m * state.delay_m;
      ++count;
    }
    const double sinc = std::sin(kPi * f * 0.02) / (kPi * f * 0.02);
    const double expected = a * delay_m * sinc / std::sqrt(1 + std::pow(2 * kPi * f / 4, 2)) / std::sqrt(2.0);
    EXPECT_NEAR(std::sqrt(square / count) / expected, 1, 0.06) << f;
  }
}

TEST(CodeLoop, KeepsItsPlaceWhereNothingIsHeardThere) {
  const CodeTracker loop = tracker();
  CodeLoopState state{0, 0, 0};
  const std::vector<SignalPath> far{{700, {1, 0}}};
  EXPECT_FALSE(loop.follow(state, far, 1, kStrong_hz));
  EXPECT_EQ(state.delay_m, 0);
}

// |R| of BOC(1,1) has its next peaks, of half the height, half a chip away (Kaplan & Hegarty, 4.2.3).
TEST(SidePeaks, AreFoundWhereTheyAre) {
  EXPECT_EQ(tracker(Modulation::BPSK).side_peak_chips(), 0);
  EXPECT_NEAR(tracker(Modulation::BOC11).side_peak_chips(), 0.5, 2.0 / 512);
  for (const Modulation modulation : {Modulation::CBOCData, Modulation::CBOCPilot, Modulation::TMBOC}) {
    const double at = tracker(modulation, 1, 0.1, 8e6).side_peak_chips();
    EXPECT_GT(at, 0.4) << name(modulation);
    EXPECT_LT(at, 0.6) << name(modulation);
  }
  EXPECT_EQ(tracker(Modulation::BPSK, 1, 0.5, 4e6).side_peak_chips(), 0);
}

class SidePeak : public testing::TestWithParam<Modulation> {};

TEST_P(SidePeak, IsLeftAfterTheCheckAndHeldForeverWithoutIt) {
  for (const double front_end : {4e6, 8e6, 20e6}) {
    for (const double side : {-1.0, 1.0}) {
      const CodeTracker checked = tracker(GetParam(), 1, 0.1, front_end);
      const CodeTracker unchecked =
          tracker(GetParam(), 1, 0.1, front_end, std::numeric_limits<double>::infinity());
      const double start = side * checked.side_peak_chips() * checked.correlation().chip_m();
      const std::vector<SignalPath> paths{{0, {1, 0}}};
      const CodeLoopState there{start, 0, 0};
      EXPECT_NEAR(followed(unchecked, there, paths, 600, 1).delay_m, start, 25);
      // The count takes a second, the remaining motion some time constants.
      EXPECT_NEAR(followed(checked, there, paths, 0.9, 0.1).delay_m, start, 25);
      EXPECT_NEAR(followed(checked, there, paths, 4, 0.1).delay_m, 0, 0.1);
    }
  }
}

TEST_P(SidePeak, TakesLongerToBeSeenInNoise) {
  const CodeTracker loop = tracker(GetParam(), 1, 0.1, 8e6);
  const double start = loop.side_peak_chips() * loop.correlation().chip_m();
  const std::vector<SignalPath> paths{{0, {1, 0}}};
  const auto seconds = [&](double cn0_dbhz) {
    CodeLoopState state{start, 0, 0};
    for (int i = 1; i <= 1000; ++i) {
      EXPECT_TRUE(loop.follow(state, paths, 0.1, std::pow(10, cn0_dbhz / 10)));
      if (state.jumped) return 0.1 * i;
    }
    return 1000.0;
  };
  EXPECT_NEAR(seconds(45), 1.0, 0.11);
  EXPECT_LT(seconds(30), 2);
  EXPECT_LT(seconds(20), 10);
  EXPECT_GT(seconds(15), seconds(30));
}

TEST_P(SidePeak, IsNoneOfTheMainPeakInAnyNoise) {
  const CodeTracker loop = tracker(GetParam(), 1, 0.1, 8e6);
  const std::vector<SignalPath> paths{{0, {1, 0}}};
  for (const double cn0_dbhz : {5.0, 10.0, 20.0, 50.0}) {
    const CodeLoopState state = followed(loop, {0, 0, 0}, paths, 600, 1, std::pow(10, cn0_dbhz / 10));
    EXPECT_NEAR(state.delay_m, 0, 1e-6) << cn0_dbhz;
  }
}

INSTANTIATE_TEST_SUITE_P(OfEveryBoc, SidePeak,
                         testing::Values(Modulation::BOC11, Modulation::CBOCData, Modulation::CBOCPilot,
                                         Modulation::TMBOC),
                         [](const auto& test) {
                           std::string word(name(test.param));
                           std::erase_if(
                               word, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; });
                           return word + std::to_string(static_cast<int>(test.param));
                         });

// An echo is tracked while it is alone, and left for the direct signal that returns before it, beyond the
// reach of the discriminator.
TEST(CodeLoop, LeavesAnEchoForAnEarlierPathThatIsStronger) {
  const CodeTracker loop = tracker(Modulation::BPSK, 1, 0.1);
  const std::vector<SignalPath> both{{0, {1, 0}}, {180, {0.4, 0.2}}};
  const CodeLoopState echo{180, 0, 0};
  EXPECT_GT(followed(loop, echo, both, 0.8, 0.1).delay_m, 145);
  EXPECT_NEAR(followed(loop, echo, both, 5, 0.1).delay_m, loop.lock(both, 0.0)->delay_m, 0.1);
  // A later one is never searched, however strong.
  const std::vector<SignalPath> strong{{0, {0.4, 0.2}}, {320, {1, 0}}};
  EXPECT_NEAR(followed(loop, {0, 0, 0}, strong, 5, 0.1).delay_m, 0, 1e-6);
}

TEST(CodeLoop, RefusesWhatIsNotFinite) {
  const CodeTracker loop = tracker();
  const std::vector<SignalPath> paths{{0, {1, 0}}};
  CodeLoopState state{std::nan(""), 0, 0};
  EXPECT_THROW((void)loop.follow(state, paths, 1, kStrong_hz), InputError);
  state.delay_m = 0;
  EXPECT_THROW((void)loop.follow(state, paths, -1, kStrong_hz), InputError);
  EXPECT_THROW((void)loop.follow(state, paths, 1, std::nan("")), InputError);
}

}  // namespace
}  // namespace canyon::tracking
