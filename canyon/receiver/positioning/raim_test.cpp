#include "canyon/receiver/positioning/least_squares.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "canyon/receiver/positioning/fix.hpp"
#include "tests/support/circular_sky.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/test_drive.hpp"

namespace canyon::positioning::raim_test {
namespace {

using geodesy::GpsTime;
using gnss::System;
using test::CircularSky;
using test::TestDrive;

const geodesy::Geodetic kPosition = geodesy::Geodetic::from_degrees(22.3, 114.18, 30);
constexpr GpsTime kTime = CircularSky::kEpoch + std::chrono::hours(5);

// Q computed with the inverse; and the closed form for a mean of n values: q = 1 - 1 / n.
TEST(LargestNormalisedResidual, IsThatOfTheWrittenOutCofactors) {
  RandomStream random(1, "rows");
  for (int run = 0; run < 100; ++run) {
    Design design(9, 5);
    Eigen::VectorXd measured(9);
    for (Eigen::Index i = 0; i < 9; ++i) {
      for (Eigen::Index k = 0; k < 5; ++k) design(i, k) = random.normal();
      measured(i) = random.normal();
    }
    const Eigen::MatrixXd a = design;
    const Eigen::MatrixXd q =
        Eigen::MatrixXd::Identity(9, 9) - a * (a.transpose() * a).inverse() * a.transpose();
    const Eigen::VectorXd residual = q * measured;
    Eigen::Index expected = 0;
    (residual.array().abs() / q.diagonal().array().sqrt()).maxCoeff(&expected);
    EXPECT_EQ(largest_normalised_residual(design, residual), expected);
  }
  // A row that alone determines an unknown has no residual to test.
  Design lone = Design::Zero(3, 2);
  lone << 1, 0, 1, 0, 0, 1;
  const Eigen::Vector3d residual(0.5, -0.5, 1e-9);
  EXPECT_EQ(largest_normalised_residual(lone, residual), 0);
  EXPECT_FALSE(largest_normalised_residual(lone.bottomRows(2), Eigen::Vector2d(0, 0)));
}

const CircularSky& sky(int systems) {
  static const CircularSky one({System::GPS});
  static const CircularSky two({System::GPS, System::Galileo});
  static const CircularSky three({System::GPS, System::Galileo, System::BeiDou});
  return systems == 1 ? one : systems == 2 ? two : three;
}

/// 48 satellites of one constellation: more than a dozen above the mask.
const CircularSky& many() {
  static const CircularSky sky({System::GPS}, 48);
  return sky;
}

FixOptions with_raim(double false_alarm = 1e-3) {
  FixOptions options;
  options.raim.enabled = true;
  options.raim.false_alarm = false_alarm;
  return options;
}

using Ids = std::vector<gnss::SatelliteId>;

Ids sorted(Ids ids) {
  std::sort(ids.begin(), ids.end());
  return ids;
}

TEST(Raim, FindsOneFaultOfTenSatellites) {
  int found = 0;
  constexpr int kRuns = 200;
  for (int run = 0; run < kRuns; ++run) {
    const GpsTime time = kTime + 60.0 * run;
    TestDrive drive(many(), time, kPosition, static_cast<std::uint64_t>(run));
    std::vector<Measurement> measurements = drive.measure();
    ASSERT_GE(measurements.size(), 10U);
    measurements.resize(10);
    Measurement& faulty = measurements[static_cast<std::size_t>(run % 10)];
    faulty.pseudorange_m += run % 20 < 10 ? 100 : -100;
    const Fix plain = solve_fix(time, measurements, many(), FixOptions{});
    const Fix fix = solve_fix(time, measurements, many(), with_raim());
    ASSERT_TRUE(fix.solved() && plain.solved());
    ASSERT_EQ(plain.used.size(), 10U);
    EXPECT_FALSE(plain.consistent);
    if (fix.excluded != Ids{faulty.id}) continue;
    ++found;
    EXPECT_EQ(fix.consistent, true);
    EXPECT_FALSE(std::binary_search(fix.used.begin(), fix.used.end(), faulty.id));
    EXPECT_EQ(fix.available, 10);
    EXPECT_LT(drive.error_enu(fix).norm(), 5 * std::sqrt(fix.covariance_enu.trace()));
    // The result is as if it had not been measured.
    measurements.erase(measurements.begin() + run % 10);
    const Fix without = solve_fix(time, measurements, many(), FixOptions{});
    EXPECT_LT((fix.position_ecef - without.position_ecef).norm(), 1e-6);
    EXPECT_LT((fix.covariance_enu - without.covariance_enu).norm(), 1e-6);
    EXPECT_NEAR(fix.dop->pdop, without.dop->pdop, 1e-6);
  }
  EXPECT_GE(found, kRuns * 95 / 100);
  std::printf("one fault of 100 m in ten satellites: %d of %d excluded, alone\n", found, kRuns);
}

// 20,000 fixes of noise alone: a binomial variable of 20,000 trials; bounds of 3.9 deviations, 1e-4.
TEST(Raim, FalseAlarmsAreAsRareAsSet) {
  constexpr int kFixes = 20'000;
  for (const double set : {1e-3, 1e-2}) {
    RandomStream random(5, "noise");
    int alarms = 0;
    std::vector<Measurement> exact;
    for (int run = 0; run < kFixes / 2; ++run) {
      const GpsTime time = kTime + 40.0 * (run / 200);
      const int systems = 1 + run / 200 % 3;
      if (run % 200 == 0) {
        TestDrive drive(sky(systems), time, kPosition, 1);
        drive.sigma_m = 0;
        exact = drive.measure();
        for (Measurement& m : exact) m.sigma_m = 0.5 + 3 * random.uniform();
      }
      for (int again = 0; again < 2; ++again) {
        const FixOptions options = with_raim(set);
        std::vector<Measurement> noisy = exact;
        for (Measurement& m : noisy) m.pseudorange_m += m.sigma_m * random.normal();
        const Fix fix =
            solve_fix(time, noisy, sky(systems), options, {}, geodesy::ecef_from_geodetic(kPosition));
        ASSERT_TRUE(fix.solved() && fix.consistent);
        if (!fix.excluded.empty() || fix.consistent == false) ++alarms;
      }
    }
    EXPECT_NEAR(alarms, kFixes * set, 3.9 * std::sqrt(kFixes * set * (1 - set)));
    std::printf("false alarms at %g: %d of %d\n", set, alarms, kFixes);
  }
}

TEST(Raim, FindsTwoFaults) {
  int found = 0;
  constexpr int kRuns = 200;
  for (int run = 0; run < kRuns; ++run) {
    const GpsTime time = kTime + 60.0 * run;
    TestDrive drive(sky(3), time, kPosition, static_cast<std::uint64_t>(run));
    std::vector<Measurement> measurements = drive.measure();
    ASSERT_GE(measurements.size(), 14U);
    const std::size_t first = static_cast<std::size_t>(run) % measurements.size();
    const std::size_t second = (first + 5) % measurements.size();
    measurements[first].pseudorange_m += 60;
    measurements[second].pseudorange_m += 90;
    const Fix fix = solve_fix(time, measurements, sky(3), with_raim());
    ASSERT_TRUE(fix.solved());
    if (sorted(fix.excluded) == sorted({measurements[first].id, measurements[second].id})) ++found;
  }
  EXPECT_GE(found, kRuns * 95 / 100);
  std::printf("two faults: %d of %d excluded, alone\n", found, kRuns);
}

// An exclusion that was only made because of another fault is reversed: each satellite excluded at the end
// fails the test when it is added again.
TEST(Raim, NothingStaysOutThatFitsIn) {
  int exclusions = 0;
  for (int run = 0; run < 300; ++run) {
    const GpsTime time = kTime + 60.0 * run;
    TestDrive drive(sky(2), time, kPosition, static_cast<std::uint64_t>(run));
    std::vector<Measurement> measurements = drive.measure();
    for (std::size_t i = 0; i < measurements.size(); i += 4) {
      measurements[i].pseudorange_m += 15 + 30 * drive.random().uniform();
    }
    FixOptions options = with_raim();
    options.raim.max_exclusions = 8;
    const Fix fix = solve_fix(time, measurements, sky(2), options);
    if (fix.consistent != true || fix.excluded.size() < 2) continue;
    for (const gnss::SatelliteId id : fix.excluded) {
      std::vector<Measurement> again;
      for (const Measurement& m : measurements) {
        if (m.id == id || std::binary_search(fix.used.begin(), fix.used.end(), m.id)) again.push_back(m);
      }
      options.raim.max_exclusions = 1;
      const Fix tested = solve_fix(time, again, sky(2), options);
      EXPECT_TRUE(tested.consistent == false || !tested.excluded.empty()) << run;
      ++exclusions;
    }
  }
  EXPECT_GT(exclusions, 100);
}

// No redundancy: nothing to test. One: a fault is detected but not identified. Then all satellites stay.
TEST(Raim, NeedsRedundancy) {
  for (int satellites = 4; satellites <= 6; ++satellites) {
    int found = 0;
    for (int run = 0; run < 50; ++run) {
      const GpsTime time = kTime + 60.0 * run;
      TestDrive drive(many(), time, kPosition, static_cast<std::uint64_t>(run));
      drive.sigma_m = 0.1;
      std::vector<Measurement> measurements = drive.measure();
      ASSERT_GE(measurements.size(), 6U);
      measurements.resize(static_cast<std::size_t>(satellites));
      measurements[2].pseudorange_m += 1000;
      FixOptions options = with_raim();
      const Fix fix = solve_fix(time, measurements, many(), options);
      options.raim.enabled = false;
      const Fix plain = solve_fix(time, measurements, many(), options);
      if (!fix.solved()) continue;
      if (fix.excluded.empty()) {
        EXPECT_EQ(fix.position_ecef, plain.position_ecef);
        EXPECT_EQ(fix.used, plain.used);
      }
      if (satellites == 4) {
        EXPECT_FALSE(fix.consistent);
      }
      if (satellites == 5) {
        EXPECT_EQ(fix.consistent, false);
        EXPECT_TRUE(fix.excluded.empty());
      }
      if (satellites == 6 && fix.excluded == Ids{measurements[2].id}) ++found;
    }
    if (satellites == 6) {
      EXPECT_GT(found, 40);
    }
  }
}

TEST(Raim, StopsAtMaxExclusions) {
  TestDrive drive(sky(3), kTime, kPosition, 3);
  std::vector<Measurement> measurements = drive.measure();
  for (std::size_t i = 0; i < 4; ++i) measurements[4 * i].pseudorange_m += 200 + 50 * static_cast<double>(i);
  for (const int maximum : {1, 2, 3}) {
    FixOptions options = with_raim();
    options.raim.max_exclusions = maximum;
    const Fix fix = solve_fix(kTime, measurements, sky(3), options);
    ASSERT_TRUE(fix.solved());
    EXPECT_EQ(static_cast<int>(fix.excluded.size()), maximum);
    EXPECT_EQ(fix.consistent, false);
    EXPECT_EQ(fix.used.size() + fix.excluded.size(), measurements.size());
  }
  FixOptions options = with_raim();
  options.raim.max_exclusions = 8;
  EXPECT_EQ(solve_fix(kTime, measurements, sky(3), options).consistent, true);
}

TEST(Raim, LeavesAConsistentFixBitForBit) {
  for (int run = 0; run < 50; ++run) {
    TestDrive drive(sky(3), kTime + 60.0 * run, kPosition, static_cast<std::uint64_t>(run));
    const std::vector<Measurement> measurements = drive.measure();
    const Fix plain = solve_fix(kTime + 60.0 * run, measurements, sky(3), FixOptions{});
    const Fix fix = solve_fix(kTime + 60.0 * run, measurements, sky(3), with_raim(1e-9));
    EXPECT_EQ(fix.consistent, true);
    EXPECT_EQ(fix.position_ecef, plain.position_ecef);
    EXPECT_EQ(fix.covariance_enu, plain.covariance_enu);
    EXPECT_EQ(fix.residuals_m, plain.residuals_m);
  }
}

// NLOS detours of 25 m on average on a quarter of 18 satellites: the metrics of docs/receiver.md.
TEST(Raim, HalvesErrorsAmongDetours) {
  std::vector<double> plain, excluded;
  for (int run = 0; run < 1000; ++run) {
    const GpsTime time = kTime + 777.0 * run;
    TestDrive drive(sky(3), time, kPosition, static_cast<std::uint64_t>(run));
    std::vector<Measurement> measurements = drive.measure();
    while (measurements.size() > 18) {
      measurements.erase(
          measurements.begin() +
          static_cast<std::ptrdiff_t>(drive.random().uniform() * static_cast<double>(measurements.size())));
    }
    for (Measurement& m : measurements) {
      if (drive.random().uniform() < 0.25) m.pseudorange_m -= 25 * std::log(1 - drive.random().uniform());
    }
    plain.push_back(drive.error_enu(solve_fix(time, measurements, sky(3), FixOptions{})).head<2>().norm());
    excluded.push_back(drive.error_enu(solve_fix(time, measurements, sky(3), with_raim())).head<2>().norm());
  }
  const auto quantile = [](std::vector<double> values, double q) {
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
  };
  EXPECT_LT(quantile(excluded, 0.5), 0.5 * quantile(plain, 0.5));
  EXPECT_LT(quantile(excluded, 0.95), 0.7 * quantile(plain, 0.95));
}

TEST(RaimOptions, NamesTheFieldThatIsOutOfRange) {
  const auto message = [](auto&& spoil) {
    FixOptions options;
    spoil(options.raim);
    return test::refusal([&] { options.validate(); });
  };
  EXPECT_EQ(message([](RaimOptions&) {}), "");
  EXPECT_THAT(message([](RaimOptions& o) { o.false_alarm = 0; }), testing::HasSubstr("false_alarm"));
  EXPECT_THAT(message([](RaimOptions& o) { o.false_alarm = 0.6; }), testing::HasSubstr("false_alarm"));
  EXPECT_THAT(message([](RaimOptions& o) { o.max_exclusions = 0; }), testing::HasSubstr("max_exclusions"));
  EXPECT_THAT(message([](RaimOptions& o) { o.max_exclusions = 31; }), testing::HasSubstr("max_exclusions"));
}

}  // namespace
}  // namespace canyon::positioning::raim_test
