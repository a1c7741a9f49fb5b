// What the filter makes of fixes that are not what their weights say, of turns that nobody expected, and what
// it does not give out.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "canyon/positioning/position_filter.hpp"
#include "tests/support/circular_sky.hpp"
#include "tests/support/test_drive.hpp"

namespace canyon::positioning {
namespace {

using gnss::System;
using test::CircularSky;
using test::TestDrive;

const geodesy::Geodetic kPlace = geodesy::Geodetic::from_degrees(22.3, 114.18, 30);
constexpr geodesy::GpsTime kTime = CircularSky::kEpoch + std::chrono::hours(5);

const CircularSky& sky() {
  static const CircularSky two({System::GPS, System::Galileo});
  return two;
}

double sigma_m(const Fix& fix) {
  return std::sqrt(fix.covariance_enu.trace());
}

/// Every third pseudorange late by 80 m.
std::vector<Measurement> in_a_street(TestDrive& drive) {
  std::vector<Measurement> measurements = drive.measure();
  for (std::size_t i = 0; i < measurements.size(); i += 3) measurements[i].pseudorange_m += 80;
  return measurements;
}

// The covariance of a start is the fix's, with what its residuals show (FixOptions::covariance_by_residuals).
TEST(PositionFilterLimits, StartsAsUnsureAsTheFix) {
  for (const bool by_residuals : {false, true}) {
    TestDrive drive(sky(), kTime, kPlace, 1);
    drive.doppler = false;
    FixOptions options;
    options.covariance_by_residuals = by_residuals;
    const std::vector<Measurement> measurements = in_a_street(drive);
    const Fix fix = solve_fix(drive.receiver_time(), measurements, sky(), options);
    PositionFilter filter({}, options);
    const Fix first = filter.update(drive.receiver_time(), measurements, sky(), fix);
    ASSERT_TRUE(fix.solved() && first.solved());
    EXPECT_LT((first.covariance_enu - fix.covariance_enu).norm(), 1e-4 * fix.covariance_enu.norm());
    EXPECT_EQ(sigma_m(first) > 10, by_residuals) << sigma_m(first);
  }
}

// Begun among detours, it is back at the truth as soon as they are gone: a start that believed its weights
// would refuse what is right. Six standard deviations of the mean of ten noisy fixes.
TEST(PositionFilterLimits, ForgetsABadStart) {
  TestDrive drive(sky(), kTime, kPlace, 2);
  FixOptions options;
  options.covariance_by_residuals = true;
  PositionFilter filter({}, options);
  Fix fix = solve_fix(drive.receiver_time(), in_a_street(drive), sky(), options);
  const double wrong = drive.error_enu(fix).norm();
  EXPECT_GT(wrong, 20);
  TestDrive again(sky(), kTime, kPlace, 2);
  (void)filter.update(again.receiver_time(), in_a_street(again), sky(), fix);
  Fix last;
  for (int i = 0; i < 10; ++i) {
    again.advance(1);
    const std::vector<Measurement> measurements = again.measure();
    fix = solve_fix(again.receiver_time(), measurements, sky(), options);
    last = filter.update(again.receiver_time(), measurements, sky(), fix);
    EXPECT_TRUE(last.excluded.empty()) << i;
  }
  EXPECT_LT(again.error_enu(last).norm(), 6 * sigma_m(fix) / std::sqrt(10));
}

// A right angle at 8 m/s within an epoch, by a filter that expects the accelerations of a walk: the Dopplers,
// which agree, are not all wrong.
TEST(PositionFilterLimits, TakesATurnThatItDidNotExpect) {
  TestDrive drive(sky(), kTime, kPlace, 3);
  drive.velocity_enu = {8, 0, 0};
  PositionFilterOptions options;
  options.acceleration_horizontal = 0.3;
  PositionFilter filter(options, {});
  for (int i = 0; i < 40; ++i) {
    if (i == 20) drive.velocity_enu = {0, 8, 0};
    const std::vector<Measurement> measurements = drive.measure();
    const Fix single = solve_fix(drive.receiver_time(), measurements, sky(), {});
    const Fix fix = filter.update(drive.receiver_time(), measurements, sky(), single);
    ASSERT_TRUE(fix.solved());
    if (i == 0) continue;
    // 0.2 Hz are 4 cm/s, of some twenty satellites.
    EXPECT_LT((*fix.velocity_enu_mps - drive.velocity_enu).norm(), 0.2) << i;
    EXPECT_LT(drive.error_enu(fix).head<2>().norm(), 6) << i;
    drive.advance(1);
  }
}

// Half of the satellites with a Doppler of their own are no turn.
TEST(PositionFilterLimits, DopplersThatDisagreeAreNoTurn) {
  TestDrive drive(sky(), kTime, kPlace, 4);
  drive.velocity_enu = {8, 0, 0};
  PositionFilterOptions options;
  options.acceleration_horizontal = 0.3;
  PositionFilter filter(options, {});
  for (int i = 0; i < 40; ++i) {
    std::vector<Measurement> measurements = drive.measure();
    for (std::size_t k = 0; i >= 20 && k < measurements.size(); ++k) {
      if (k % 5 < 2) *measurements[k].doppler_hz += k % 2 == 0 ? 60 : -60;  // 11 m/s
    }
    const Fix single = solve_fix(drive.receiver_time(), measurements, sky(), {});
    const Fix fix = filter.update(drive.receiver_time(), measurements, sky(), single);
    ASSERT_TRUE(fix.solved());
    if (i > 0) {
      EXPECT_LT((*fix.velocity_enu_mps - drive.velocity_enu).norm(), 0.2) << i;
    }
    drive.advance(1);
  }
}

TEST(PositionFilterLimits, GivesOutNothingBeyondItsAccuracy) {
  TestDrive drive(sky(), kTime, kPlace, 5);
  FixOptions options;
  options.covariance_by_residuals = true;
  PositionFilterOptions limited;
  limited.max_sigma_m = 10;
  PositionFilter filter(limited, options);
  // Nothing is begun among detours, though there is a fix.
  const std::vector<Measurement> late = in_a_street(drive);
  const Fix wrong = solve_fix(drive.receiver_time(), late, sky(), options);
  ASSERT_TRUE(wrong.solved());
  ASSERT_GT(sigma_m(wrong), 10);
  const Fix none = filter.update(drive.receiver_time(), late, sky(), wrong);
  EXPECT_EQ(none.status, FixStatus::WeakGeometry);
  EXPECT_TRUE(std::isnan(none.position_ecef.x()));
  EXPECT_TRUE(none.used.empty());
  EXPECT_EQ(none.available, wrong.available);
  drive.advance(1);
  const std::vector<Measurement> right = drive.measure();
  const Fix fix = solve_fix(drive.receiver_time(), right, sky(), options);
  ASSERT_TRUE(filter.update(drive.receiver_time(), right, sky(), fix).solved());
  // Coasting, white acceleration of density q adds q t^3 / 3 to the variance of each axis: 3.16^2 / 3 (twice)
  // and 0.5^2 / 3, so that 10 m are over after 2.4 s at the latest, before coast_s is.
  Fix unsolved;
  unsolved.status = FixStatus::TooFewSatellites;
  EXPECT_TRUE(filter.update(drive.receiver_time() + 1, {}, sky(), unsolved).solved());
  const Fix later = filter.update(drive.receiver_time() + 3, {}, sky(), unsolved);
  EXPECT_EQ(later.status, FixStatus::WeakGeometry);
  EXPECT_TRUE(later.used.empty());
  // It is still known where it was: one epoch of measurements and it is there again.
  drive.advance(4);
  const std::vector<Measurement> back = drive.measure();
  const Fix again = filter.update(drive.receiver_time(), back, sky(), unsolved);
  EXPECT_TRUE(again.solved());
  EXPECT_LT(drive.error_enu(again).norm(), 10);
}

}  // namespace
}  // namespace canyon::positioning
