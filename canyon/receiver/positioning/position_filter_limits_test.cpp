// The filter with fixes whose errors do not fit their weights and with unexpected turns, and the positions
// that it rejects.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

#include "canyon/receiver/positioning/position_filter.hpp"
#include "tests/support/circular_sky.hpp"
#include "tests/support/test_drive.hpp"

namespace canyon::positioning::position_filter_limits_test {
namespace {

using gnss::System;
using test::CircularSky;
using test::TestDrive;

const geodesy::Geodetic kPosition = geodesy::Geodetic::from_degrees(22.3, 114.18, 30);
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

// The covariance of a start is the fix's, increased by its residuals (FixOptions::covariance_by_residuals).
TEST(PositionFilterLimits, StartsAsUnsureAsTheFix) {
  for (const bool by_residuals : {false, true}) {
    TestDrive drive(sky(), kTime, kPosition, 1);
    drive.doppler = false;
    FixOptions options;
    options.covariance_by_residuals = by_residuals;
    const std::vector<Measurement> measurements = in_a_street(drive);
    const Fix fix = solve_fix(drive.receiver_time(), measurements, sky(), options);
    PositionFilter filter({}, options);
    const Fix first = filter.update(drive.receiver_time(), measurements, sky(), fix);
    ASSERT_TRUE(fix.solved() && first.solved());
    EXPECT_LT((first.covariance_enu - fix.covariance_enu).norm(), 2e-4 * fix.covariance_enu.norm());
    EXPECT_EQ(sigma_m(first) > 10, by_residuals) << sigma_m(first);
  }
}

// Started with detours, it is back at the truth as soon as they end: a start that relied on its weights would
// reject right measurements. Six standard deviations of the mean of ten noisy fixes.
TEST(PositionFilterLimits, ForgetsABadStart) {
  TestDrive drive(sky(), kTime, kPosition, 2);
  FixOptions options;
  options.covariance_by_residuals = true;
  PositionFilter filter({}, options);
  Fix fix = solve_fix(drive.receiver_time(), in_a_street(drive), sky(), options);
  const double wrong = drive.error_enu(fix).norm();
  EXPECT_GT(wrong, 20);
  TestDrive again(sky(), kTime, kPosition, 2);
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

/// Mean normalised squared error of the position after 80 epochs of 0.5 s at rest, in 100 runs: errors of 3 m
/// with a time constant of 2 s, which the filter's options contain or not.
double mean_nees_of_lasting_errors(double assumed_s) {
  constexpr int kRuns = 100;
  const double a = std::exp(-0.5 / 2);
  PositionFilterOptions options;
  options.acceleration_horizontal = options.acceleration_vertical = 0.01;  // it averages over many errors
  options.error_correlation_s = assumed_s;
  double sum = 0;
  for (int run = 0; run < kRuns; ++run) {
    TestDrive drive(sky(), kTime, kPosition, static_cast<std::uint64_t>(run));
    drive.sigma_m = 3;
    PositionFilter filter(options, {});
    std::map<gnss::SatelliteId, double> error;
    Fix fix;
    for (int i = 0; i < 80; ++i) {
      if (i > 0) drive.advance(0.5);
      std::vector<Measurement> measurements = drive.measure();
      drive.sigma_m = 0;
      std::vector<Measurement> clean = drive.measure();
      drive.sigma_m = 3;
      for (std::size_t k = 0; k < measurements.size(); ++k) {
        const double white = measurements[k].pseudorange_m - clean[k].pseudorange_m;
        const auto [last, first] = error.try_emplace(measurements[k].id, white);
        if (!first) last->second = a * last->second + std::sqrt(1 - a * a) * white;
        measurements[k].pseudorange_m = clean[k].pseudorange_m + last->second;
      }
      fix = filter.update(drive.receiver_time(), measurements, sky(),
                          solve_fix(drive.receiver_time(), measurements, sky(), {}));
    }
    const Eigen::Vector3d e = drive.error_enu(fix);
    sum += e.dot(fix.covariance_enu.inverse() * e) / kRuns;
  }
  return sum;
}

// Chi-square of 3; the mean of 100 has the standard deviation sqrt(2 * 300) / 100 = 0.245. White errors'
// covariance is too small by (1 + a) / (1 - a) = 8.04 (Bartlett 1946).
TEST(PositionFilterLimits, StatesItsAccuracyForErrorsThatLast) {
  EXPECT_GT(mean_nees_of_lasting_errors(0), 15);
  EXPECT_NEAR(mean_nees_of_lasting_errors(2), 3, 0.5);
}

// Constant errors are not averaged: the filter then reports the accuracy of the epoch alone. Satellites that
// failed the gate count in the residuals.
TEST(PositionFilterLimits, StatesTheEpochsAccuracyForErrorsThatNeverChange) {
  for (const bool by_residuals : {false, true}) {
    TestDrive drive(sky(), kTime, kPosition, 6);
    FixOptions options;
    options.covariance_by_residuals = by_residuals;
    PositionFilterOptions lasting;
    lasting.error_correlation_s = 3600;
    PositionFilter white({}, options), filter(lasting, options);
    for (int i = 0; i < 30; ++i) {
      const std::vector<Measurement> measurements = i < 10 ? drive.measure() : in_a_street(drive);
      const Fix fix = solve_fix(drive.receiver_time(), measurements, sky(), options);
      const Fix reported = filter.update(drive.receiver_time(), measurements, sky(), fix);
      const Fix other = white.update(drive.receiver_time(), measurements, sky(), fix);
      EXPECT_EQ(reported.position_ecef, other.position_ecef);
      if (i > 1) {
        if (i < 10) {
          EXPECT_GT(sigma_m(reported), 0.85 * sigma_m(fix)) << i;
          EXPECT_LT(sigma_m(reported), (by_residuals ? 1.5 : 1.03) * sigma_m(fix)) << i;
        }
        EXPECT_LT(sigma_m(other), 0.8 * sigma_m(reported)) << i;
        EXPECT_EQ(sigma_m(other) > 4, by_residuals && i >= 10) << i << ": " << sigma_m(other);
      }
      drive.advance(1);
    }
  }
}

// A right angle at 8 m/s within an epoch, with a filter for the accelerations of a walk: the Dopplers, which
// agree, are not all wrong.
TEST(PositionFilterLimits, TakesATurnThatItDidNotExpect) {
  TestDrive drive(sky(), kTime, kPosition, 3);
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

// Half of the satellites with inconsistent Dopplers are no turn.
TEST(PositionFilterLimits, DopplersThatDisagreeAreNoTurn) {
  TestDrive drive(sky(), kTime, kPosition, 4);
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
  TestDrive drive(sky(), kTime, kPosition, 5);
  FixOptions options;
  options.covariance_by_residuals = true;
  PositionFilterOptions limited;
  limited.max_sigma_m = 10;
  PositionFilter filter(limited, options);
  // No start with detours, although there is a fix.
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
  // Its state is kept: one epoch of measurements restores it.
  drive.advance(4);
  const std::vector<Measurement> back = drive.measure();
  const Fix again = filter.update(drive.receiver_time(), back, sky(), unsolved);
  EXPECT_TRUE(again.solved());
  EXPECT_LT(drive.error_enu(again).norm(), 10);
}

}  // namespace
}  // namespace canyon::positioning::position_filter_limits_test
