#include "canyon/tracking/path_phase.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/tracking/code_tracking.hpp"

namespace canyon::tracking {
namespace {

using geodesy::kPi;

constexpr double kL1 = geodesy::kSpeedOfLight / 1575.42e6;

TEST(PathPhases, AreUniformOverReflectors) {
  const PathPhases phases(7, "rover");
  const int n = 100'000;
  double c1 = 0, s1 = 0, c2 = 0, s2 = 0;
  for (int i = 0; i < n; ++i) {
    const double phase = phases.phase_rad("G05", static_cast<std::uint64_t>(i), 31.4, kL1);
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

TEST(PathPhases, TurnByACycleForEachWavelength) {
  const PathPhases phases(7, "rover");
  const double at = phases.phase_rad("E11", 3, 100, kL1);
  for (const double more : {0.01, 0.05, 0.19, 1.0, 523.1}) {
    const double turned = phases.phase_rad("E11", 3, 100 + more, kL1) - at;
    EXPECT_NEAR(std::remainder(turned + 2 * kPi * more / kL1, 2 * kPi), 0, 1e-9) << more;
  }
}

TEST(PathPhases, DependOnSeedReceiverSatelliteAndReflectorAlone) {
  const PathPhases phases(7, "rover");
  const double phase = phases.phase_rad("G05", 1, 10, kL1);
  (void)phases.phase_rad("G06", 9, 11, kL1);
  EXPECT_EQ(phases.phase_rad("G05", 1, 10, kL1), phase);
  EXPECT_EQ(PathPhases(7, "rover").phase_rad("G05", 1, 10, kL1), phase);
  EXPECT_NE(PathPhases(8, "rover").phase_rad("G05", 1, 10, kL1), phase);
  EXPECT_NE(PathPhases(7, "base").phase_rad("G05", 1, 10, kL1), phase);
  EXPECT_NE(phases.phase_rad("G06", 1, 10, kL1), phase);
  EXPECT_NE(phases.phase_rad("G05", 2, 10, kL1), phase);
}

TEST(PathPhases, RefuseBadInput) {
  const PathPhases phases(7, "rover");
  EXPECT_THROW((void)phases.phase_rad("G05", 1, std::nan(""), kL1), InputError);
  EXPECT_THROW((void)phases.phase_rad("G05", 1, 1, 0), InputError);
}

// Image method: excess 2 h (n.s), h the distance to the wall's plane. A wall, a moving antenna and a moving
// satellite; the rate against the central difference of that closed form.
TEST(ExcessRate, IsTheDerivativeOfTheImageMethod) {
  const Eigen::Vector3d normal = Eigen::Vector3d(-0.8, 0.5, 0.1).normalized();
  const Eigen::Vector3d wall(40, -10, 3);
  const Eigen::Vector3d velocity(11, -3, 0.4);
  const Eigen::Vector3d axis = Eigen::Vector3d(0.3, 0.5, -0.8).normalized() * 1.5e-4;
  const Eigen::Vector3d start = Eigen::Vector3d(-0.4, 0.7, 0.6).normalized();
  const auto satellite = [&](double t) -> Eigen::Vector3d {
    return (start + t * axis.cross(start)).normalized();
  };
  const auto excess = [&](double t) {
    const double height = normal.dot(t * velocity - wall);
    return 2 * height * normal.dot(satellite(t));
  };
  ASSERT_GT(excess(0), 0);
  const Eigen::Vector3d arrival = start - 2 * start.dot(normal) * normal;
  const double h = 1e-3;
  const double expected = (excess(h) - excess(-h)) / (2 * h);
  EXPECT_NEAR(excess_rate_mps(start, arrival, velocity, excess(0), axis.cross(start)), expected, 1e-6);
  // Without the satellite's motion: centimetres per second off.
  EXPECT_NEAR(excess_rate_mps(start, arrival, velocity), expected, 0.03);
  EXPECT_GT(std::abs(excess_rate_mps(start, arrival, velocity) - expected), 1e-4);
  EXPECT_EQ(excess_rate_mps(start, start, velocity), 0);
}

TEST(ExcessRate, DrivingTowardsTheWall) {
  // Straight at a wall ahead with the satellite low behind: the echo's detour shrinks by twice the speed.
  const Eigen::Vector3d behind(0, -1, 0);
  const Eigen::Vector3d ahead(0, 1, 0);
  const double rate = excess_rate_mps(behind, ahead, {0, 10, 0});
  EXPECT_EQ(rate, -20);
  // It arrives with a higher frequency: 105 Hz at L1.
  EXPECT_NEAR(fading_rate_hz(rate, kL1), 20 / kL1, 1e-12);
}

// All of it together: one wall, a weak echo half a chip late. Standing antennas, each with a phase of its
// own, err by alpha d / 2 cos(phase): alpha d / (2 sqrt 2) root mean square. An antenna that drives away from
// the wall at 1 m/s has its echo fade with 10.5 Hz; the loop and the integration leave their shares of it.
TEST(PathPhases, DrivingAveragesMultipathOut) {
  DllOptions options;
  options.discriminator = Discriminator::DotProduct;
  options.spacing_chips = 0.1;
  const CodeTracker tracker({}, options);
  const double chip = tracker.correlation().chip_m();
  const double alpha = 0.01;
  const PathPhases phases(3, "rover");
  const Eigen::Vector3d satellite(0, -1, 0);
  const Eigen::Vector3d wall(0, 1, 0);
  const auto rms = [&](double speed) {
    const double fading = fading_rate_hz(excess_rate_mps(satellite, wall, {0, -speed, 0}), kL1);
    double sum2 = 0;
    const int n = 2'000;
    for (int i = 0; i < n; ++i) {
      const double phase = phases.phase_rad("G05", static_cast<std::uint64_t>(i), 0.5 * chip, kL1);
      const std::vector<SignalPath> paths{{0, {1, 0}, 0}, {0.5 * chip, std::polar(alpha, phase), fading}};
      const double error = tracker.lock(paths, 0.0)->delay_m;
      sum2 += error * error;
    }
    return std::sqrt(sum2 / n);
  };
  const double standing = rms(0);
  // Squares of cosines vary by 1/8: the root mean square of 2000 is known to 0.8 %, five of them.
  EXPECT_NEAR(standing, alpha * 0.1 / (2 * std::sqrt(2.0)) * chip, 0.04 * standing);
  const double f = 2 / kL1;
  const double x = kPi * f * options.integration_s;
  const double kept = std::sin(x) / x / std::hypot(1, kPi * f / (2 * options.loop_bandwidth_hz));
  EXPECT_LT(kept, 0.06);
  EXPECT_NEAR(rms(1), kept * standing, 0.05 * kept * standing);
}

}  // namespace
}  // namespace canyon::tracking
