#include "canyon/receiver/tracking/channel_fading.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/receiver/tracking/code_tracking.hpp"

namespace canyon::tracking {
namespace {

using geodesy::kPi;

constexpr double kL1 = geodesy::kSpeedOfLight / 1575.42e6;

TEST(PathPhases, AreUniformOverReflectors) {
  const PathPhases phases(7, "rover");
  const int n = 100'000;
  double c1 = 0, s1 = 0, c2 = 0, s2 = 0;
  for (int i = 0; i < n; ++i) {
    const double phase = phases.phase_rad("G05", static_cast<std::uint64_t>(i));
    ASSERT_GT(phase, -kPi);
    ASSERT_LE(phase, kPi);
    c1 += std::cos(phase);
    s1 += std::sin(phase);
    c2 += std::cos(2 * phase);
    s2 += std::sin(2 * phase);
  }
  // Mean of a cosine of uniform phases: variance 1/2n; five sigma, a chance of 2e-6 in all.
  const double bound = 5 * std::sqrt(0.5 / n);
  EXPECT_LT(std::abs(c1 / n), bound);
  EXPECT_LT(std::abs(s1 / n), bound);
  EXPECT_LT(std::abs(c2 / n), bound);
  EXPECT_LT(std::abs(s2 / n), bound);
}

TEST(PathPhases, DependOnSeedReceiverSatelliteAndReflectorAlone) {
  const PathPhases phases(7, "rover");
  const double phase = phases.phase_rad("G05", 1);
  (void)phases.phase_rad("G06", 9);
  EXPECT_EQ(phases.phase_rad("G05", 1), phase);
  EXPECT_EQ(PathPhases(7, "rover").phase_rad("G05", 1), phase);
  EXPECT_NE(PathPhases(8, "rover").phase_rad("G05", 1), phase);
  EXPECT_NE(PathPhases(7, "base").phase_rad("G05", 1), phase);
  EXPECT_NE(phases.phase_rad("G06", 1), phase);
  EXPECT_NE(phases.phase_rad("G05", 2), phase);
}

// Full model: one wall, a weak echo half a chip late. Stationary antennas, each with its own phase, have
// errors of alpha d / 2 cos(phase): alpha d / (2 sqrt 2) root mean square. For an antenna that drives away
// from the wall at 1 m/s the echo fades with 10.5 Hz; the loop and the integration leave a fraction of it.
TEST(PathPhases, DrivingAveragesMultipathOut) {
  DllOptions options;
  options.discriminator = Discriminator::DotProduct;
  options.spacing_chips = 0.1;
  const CodeTracker tracker({}, options);
  const double chip = tracker.correlation().chip_m();
  const double alpha = 0.01;
  const PathPhases phases(3, "rover");
  const auto rms = [&](double speed) {
    const double fading = fading_rate_hz(2 * speed, kL1);
    double sum2 = 0;
    const int n = 2'000;
    for (int i = 0; i < n; ++i) {
      const double phase = phases.phase_rad("G05", static_cast<std::uint64_t>(i));
      const std::vector<SignalPath> paths{{0, {1, 0}, 0}, {0.5 * chip, std::polar(alpha, phase), fading}};
      const double error = tracker.lock(paths, 0.0)->delay_m;
      sum2 += error * error;
    }
    return std::sqrt(sum2 / n);
  };
  const double is_stationary = rms(0);
  // Squares of cosines vary by 1/8: the root mean square of 2000 is known to 0.8 %, five of them.
  EXPECT_NEAR(is_stationary, alpha * 0.1 / (2 * std::sqrt(2.0)) * chip, 0.04 * is_stationary);
  const double f = 2 / kL1;
  const double x = kPi * f * options.integration_s;
  const double kept = std::sin(x) / x / std::hypot(1, kPi * f / (2 * options.loop_bandwidth_hz));
  EXPECT_LT(kept, 0.06);
  EXPECT_NEAR(rms(1), kept * is_stationary, 0.05 * kept * is_stationary);
}

}  // namespace
}  // namespace canyon::tracking
