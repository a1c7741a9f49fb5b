#include "canyon/receiver/positioning/fix.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/receiver/tracking/noise.hpp"
#include "canyon/sky/orbit/sky.hpp"
#include "tests/support/circular_sky.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/spoiled_options.hpp"

namespace canyon::positioning {
namespace {

using geodesy::GpsTime;
using geodesy::kSpeedOfLight;
using gnss::System;
using test::CircularSky;

const geodesy::Geodetic kPosition = geodesy::Geodetic::from_degrees(22.3, 114.18, 30);
const Eigen::Vector3d kTruth = geodesy::ecef_from_geodetic(kPosition);
constexpr GpsTime kTime = CircularSky::kEpoch + std::chrono::hours(5);

/// Exact pseudoranges of all satellites above `mask_deg`, by an independent measurement equation.
std::vector<Measurement> measure(const orbit::Sky& sky, GpsTime time = kTime, double mask_deg = 10,
                                 double receiver_bias_s = 0) {
  std::vector<Measurement> measurements;
  for (const gnss::SatelliteId id : sky.satellites()) {
    const auto line = orbit::line_of_sight(sky, id, time, kTruth);
    if (!line || line->elevation_rad < geodesy::radians(mask_deg)) continue;
    Measurement m;
    m.id = id;
    m.carrier_frequency_hz = line->state.carrier_frequency_hz;
    m.pseudorange_m = line->range_m + kSpeedOfLight * receiver_bias_s -
                      kSpeedOfLight * (line->state.clock_bias_s - line->state.group_delay_s);
    measurements.push_back(m);
  }
  return measurements;
}

std::vector<Measurement> only(std::vector<Measurement> all, System system, std::size_t count) {
  std::vector<Measurement> kept;
  for (const Measurement& m : all) {
    if (m.id.system == system && kept.size() < count) kept.push_back(m);
  }
  EXPECT_EQ(kept.size(), count);
  return kept;
}

std::vector<Measurement> join(std::vector<Measurement> a, const std::vector<Measurement>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// Design matrix at the truth: minus unit vectors in ENU, one clock column for each system present.
Eigen::MatrixXd design_at_truth(const orbit::Sky& sky, const std::vector<gnss::SatelliteId>& used) {
  std::vector<System> systems;
  for (const auto& id : used) {
    if (std::find(systems.begin(), systems.end(), id.system) == systems.end()) systems.push_back(id.system);
  }
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(used.size()),
                                            3 + static_cast<Eigen::Index>(systems.size()));
  const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(kPosition);
  for (std::size_t i = 0; i < used.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const auto line = orbit::line_of_sight(sky, used[i], kTime, kTruth);
    a.block<1, 3>(row, 0) = -(enu_from_ecef * line->direction_ecef).transpose();
    a(row, 3 + (std::find(systems.begin(), systems.end(), used[i].system) - systems.begin())) = 1;
  }
  return a;
}

const CircularSky& four_systems() {
  static const CircularSky sky({System::GPS, System::GLONASS, System::Galileo, System::BeiDou});
  return sky;
}

TEST(SolveFix, FindsTheTruthFromTheCentreOfTheEarth) {
  for (const double bias : {0.0, 5e-4, -5e-4, 0.1}) {
    const std::vector<Measurement> measurements = measure(four_systems(), kTime, 10, bias);
    ASSERT_GE(measurements.size(), 20U);
    const Fix fix = solve_fix(kTime + bias, measurements, four_systems(), FixOptions{});
    ASSERT_TRUE(fix.solved()) << reason(fix.status);
    EXPECT_LT((fix.position_ecef - kTruth).norm(), 1e-4) << bias;
    EXPECT_EQ(fix.used.size(), measurements.size());
    EXPECT_EQ(fix.available, static_cast<int>(measurements.size()));
    EXPECT_TRUE(std::is_sorted(fix.used.begin(), fix.used.end()));
    EXPECT_EQ(fix.unknowns, 7);
    EXPECT_EQ(fix.rank, 7);
    EXPECT_LE(fix.iterations, 8);
    ASSERT_EQ(fix.clock_bias_s.size(), 4U);
    for (const auto& [system, clock] : fix.clock_bias_s) EXPECT_NEAR(clock, bias, 1e-12);
    for (const double residual : fix.residuals_m) EXPECT_NEAR(residual, 0, 1e-4);
    EXPECT_NEAR(fix.position.latitude_rad, kPosition.latitude_rad, 1e-10);
    EXPECT_NEAR(fix.position.longitude_rad, kPosition.longitude_rad, 1e-10);
    EXPECT_NEAR(fix.position.height_m, kPosition.height_m, 1e-3);
    EXPECT_FALSE(fix.velocity_enu_mps);  // no Doppler was given
  }
}

TEST(SolveFix, StartAndOrderDoNotMatter) {
  std::vector<Measurement> measurements = measure(four_systems());
  const Fix reference = solve_fix(kTime, measurements, four_systems(), FixOptions{});
  std::reverse(measurements.begin(), measurements.end());
  const std::vector<Eigen::Vector3d> starts{kTruth, kTruth + Eigen::Vector3d(1e5, -2e5, 3e4), -kTruth};
  for (const auto& start : starts) {
    const Fix fix = solve_fix(kTime, measurements, four_systems(), FixOptions{}, {}, start);
    ASSERT_TRUE(fix.solved());
    EXPECT_LT((fix.position_ecef - reference.position_ecef).norm(), 1e-6);
    EXPECT_EQ(fix.used, reference.used);
  }
}

// A time scale error of a system only changes its own clock.
TEST(SolveFix, InterSystemBiasGoesToTheClockOfItsConstellation) {
  std::vector<Measurement> measurements = measure(four_systems());
  for (Measurement& m : measurements) {
    if (m.id.system == System::Galileo) m.pseudorange_m += 30;
  }
  const Fix fix = solve_fix(kTime, measurements, four_systems(), FixOptions{});
  ASSERT_TRUE(fix.solved());
  EXPECT_LT((fix.position_ecef - kTruth).norm(), 1e-3);  // 30 m are 0.1 us: the satellite moves by 0.4 mm
  EXPECT_NEAR(fix.clock_bias_s.at(System::Galileo) * kSpeedOfLight, 30, 1e-3);
  EXPECT_NEAR(fix.clock_bias_s.at(System::GPS) * kSpeedOfLight, 0, 1e-3);
}

// SBAS keeps GPS's time within 50 ns (ICAO Annex 10, 3.7.3.4.5): one unknown for both.
TEST(SolveFix, SbasSharesTheClockOfGps) {
  const CircularSky sky({System::GPS, System::Galileo, System::SBAS});
  std::vector<Measurement> measurements = measure(sky, kTime, 10, 2e-4);
  const Fix both = solve_fix(kTime + 2e-4, measurements, sky, FixOptions{});
  ASSERT_TRUE(both.solved());
  EXPECT_EQ(both.used.size(), measurements.size());
  EXPECT_EQ(both.unknowns, 5);
  ASSERT_EQ(both.clock_bias_s.size(), 2U);
  EXPECT_NEAR(both.clock_bias_s.at(System::GPS), 2e-4, 1e-12);
  EXPECT_EQ(both.clock_bias_s.count(System::SBAS), 0U);

  // Satellites of both, one of them alone, count for the common clock.
  const std::vector<Measurement> few =
      join(only(measurements, System::GPS, 1), only(measurements, System::SBAS, 4));
  const Fix fix = solve_fix(kTime + 2e-4, few, sky, FixOptions{});
  ASSERT_TRUE(fix.solved()) << reason(fix.status);
  EXPECT_EQ(fix.unknowns, 4);
  EXPECT_EQ(fix.used.size(), 5U);
  EXPECT_LT((fix.position_ecef - kTruth).norm(), 1e-4);
  EXPECT_NEAR(fix.clock_bias_s.at(System::GPS), 2e-4, 1e-12);
  const Fix alone = solve_fix(kTime + 2e-4, only(measurements, System::SBAS, 5), sky, FixOptions{});
  EXPECT_NEAR(alone.clock_bias_s.at(System::GPS), 2e-4, 1e-12);
}

TEST(SolveFix, CovarianceAndDopAreThoseOfTheDesignAtTheTruth) {
  std::vector<Measurement> measurements = measure(four_systems());
  RandomStream random(1, "sigma");
  for (Measurement& m : measurements) m.sigma_m = 1 + 3 * random.uniform();
  std::reverse(measurements.begin(), measurements.end());
  const Fix fix = solve_fix(kTime, measurements, four_systems(), FixOptions{});
  ASSERT_TRUE(fix.solved());

  const Eigen::MatrixXd a = design_at_truth(four_systems(), fix.used);
  Eigen::VectorXd weight(a.rows());
  for (std::size_t i = 0; i < fix.used.size(); ++i) {
    const auto m = std::find_if(measurements.begin(), measurements.end(),
                                [&](const Measurement& each) { return each.id == fix.used[i]; });
    weight(static_cast<Eigen::Index>(i)) = 1 / (m->sigma_m * m->sigma_m);
  }
  const Eigen::MatrixXd covariance = (a.transpose() * weight.asDiagonal() * a).inverse();
  EXPECT_LT((fix.covariance_enu - covariance.topLeftCorner<3, 3>()).norm(), 1e-6 * covariance.norm());

  const Eigen::MatrixXd q = (a.transpose() * a).inverse();
  ASSERT_TRUE(fix.dop);
  EXPECT_NEAR(fix.dop->hdop, std::sqrt(q(0, 0) + q(1, 1)), 1e-6);
  EXPECT_NEAR(fix.dop->vdop, std::sqrt(q(2, 2)), 1e-6);
  EXPECT_NEAR(fix.dop->tdop, std::sqrt(q.diagonal().tail(4).sum()), 1e-6);
  EXPECT_NEAR(std::pow(fix.dop->pdop, 2), std::pow(fix.dop->hdop, 2) + std::pow(fix.dop->vdop, 2), 1e-9);
  EXPECT_NEAR(std::pow(fix.dop->gdop, 2), std::pow(fix.dop->pdop, 2) + std::pow(fix.dop->tdop, 2), 1e-9);
}

TEST(SolveFix, ErrorsOfManyNoisyFixesHaveTheStatedCovariance) {
  std::vector<Measurement> exact = measure(four_systems());
  RandomStream random(2, "noise");
  for (Measurement& m : exact) m.sigma_m = 0.5 + 2 * random.uniform();
  constexpr int kRuns = 2000;
  Eigen::Matrix3d sample = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d reported = Eigen::Matrix3d::Zero();
  const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(kPosition);
  double chi2 = 0;
  int degrees = 0;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<Measurement> noisy = exact;
    for (Measurement& m : noisy) m.pseudorange_m += m.sigma_m * random.normal();
    const Fix fix = solve_fix(kTime, noisy, four_systems(), FixOptions{}, {}, kTruth);
    ASSERT_TRUE(fix.solved());
    const Eigen::Vector3d error = enu_from_ecef * (fix.position_ecef - kTruth);
    sample += error * error.transpose() / kRuns;
    reported = fix.covariance_enu;
    // Weighted residuals are chi-square with as many degrees as satellites beyond the unknowns.
    for (std::size_t i = 0; i < fix.used.size(); ++i) {
      const auto m = std::find_if(exact.begin(), exact.end(),
                                  [&](const Measurement& each) { return each.id == fix.used[i]; });
      chi2 += std::pow(fix.residuals_m[i] / m->sigma_m, 2);
    }
    degrees += static_cast<int>(fix.used.size()) - fix.unknowns;
  }
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double deviation =
          std::sqrt((reported(i, i) * reported(k, k) + reported(i, k) * reported(i, k)) / kRuns);
      EXPECT_NEAR(sample(i, k), reported(i, k), 5 * deviation) << i << k;
    }
  }
  EXPECT_NEAR(chi2 / degrees, 1, 5 * std::sqrt(2.0 / degrees));
}

TEST(SolveFix, MaskIsAppliedAtTheIteratedPosition) {
  const std::vector<Measurement> measurements = measure(four_systems(), kTime, 0);
  for (const double mask_deg : {5.0, 15.0, 30.0}) {
    FixOptions options;
    options.elevation_mask_rad = geodesy::radians(mask_deg);
    const Fix fix = solve_fix(kTime, measurements, four_systems(), options);
    ASSERT_TRUE(fix.solved());
    std::vector<gnss::SatelliteId> expected;
    for (const Measurement& m : measure(four_systems(), kTime, mask_deg)) expected.push_back(m.id);
    EXPECT_EQ(fix.used, expected) << mask_deg;
    EXPECT_LT(fix.used.size(), measurements.size());
  }
}

// A satellite exactly at the mask may be on either side, but counts, covariance and status stay consistent.
TEST(SolveFix, SatelliteAtTheMaskDoesNotKeepItFromSettling) {
  std::vector<Measurement> measurements = measure(four_systems(), kTime, 0);
  double lowest = 1;
  for (const Measurement& m : measurements) {
    const double elevation = orbit::line_of_sight(four_systems(), m.id, kTime, kTruth)->elevation_rad;
    if (elevation > geodesy::radians(12)) lowest = std::min(lowest, elevation);
  }
  RandomStream random(3, "edge");
  for (int run = 0; run < 200; ++run) {
    std::vector<Measurement> noisy = measurements;
    for (Measurement& m : noisy) m.pseudorange_m += 50 * random.normal();
    FixOptions options;
    options.elevation_mask_rad = lowest + 1e-6 * random.normal();
    const Fix fix = solve_fix(kTime, noisy, four_systems(), options);
    ASSERT_TRUE(fix.solved()) << reason(fix.status);
    EXPECT_EQ(fix.used.size(), fix.residuals_m.size());
    EXPECT_EQ(fix.available, static_cast<int>(fix.used.size()));
  }
}

TEST(SolveFix, LoneSatelliteOfAConstellationIsLeftOut) {
  const std::vector<Measurement> all = measure(four_systems());
  const std::vector<Measurement> gps = only(all, System::GPS, 5);
  const Fix alone = solve_fix(kTime, gps, four_systems(), FixOptions{});
  const Fix with = solve_fix(kTime, join(gps, only(all, System::Galileo, 1)), four_systems(), FixOptions{});
  ASSERT_TRUE(alone.solved() && with.solved());
  EXPECT_EQ(with.used, alone.used);
  EXPECT_EQ(with.unknowns, 4);
  EXPECT_EQ(with.available, 6);
  EXPECT_EQ(with.position_ecef, alone.position_ecef);
  EXPECT_EQ(with.clock_bias_s.count(System::Galileo), 0U);
}

TEST(SolveFix, CountsSatellitesAgainstClocks) {
  const std::vector<Measurement> all = measure(four_systems());
  const auto status = [&](std::size_t gps, std::size_t galileo, int needed) {
    FixOptions options;
    options.min_satellites = needed;
    return solve_fix(kTime, join(only(all, System::GPS, gps), only(all, System::Galileo, galileo)),
                     four_systems(), options)
        .status;
  };
  EXPECT_EQ(status(4, 0, 4), FixStatus::Fix);
  EXPECT_EQ(status(4, 0, 5), FixStatus::TooFewSatellites);
  EXPECT_EQ(status(5, 0, 5), FixStatus::Fix);
  EXPECT_EQ(status(3, 0, 4), FixStatus::TooFewSatellites);
  EXPECT_EQ(status(3, 1, 4), FixStatus::TooFewSatellites);
  EXPECT_EQ(status(2, 2, 4), FixStatus::TooFewSatellites);
  EXPECT_EQ(status(3, 2, 4), FixStatus::Fix);
  EXPECT_EQ(status(3, 2, 5), FixStatus::TooFewSatellites);
  EXPECT_EQ(status(4, 2, 5), FixStatus::Fix);
}

/// measure() with the Dopplers of an antenna at rest: the slope of pseudoranges over a second.
std::vector<Measurement> measure_with_dopplers() {
  std::vector<Measurement> measured = measure(four_systems());
  const auto later = measure(four_systems(), kTime + 0.5, 0),
             before = measure(four_systems(), kTime - 0.5, 0);
  const auto range_m = [](const std::vector<Measurement>& of, gnss::SatelliteId id) {
    return std::find_if(of.begin(), of.end(), [id](const Measurement& m) { return m.id == id; })
        ->pseudorange_m;
  };
  for (Measurement& m : measured) {
    m.doppler_hz = -m.carrier_frequency_hz / kSpeedOfLight * (range_m(later, m.id) - range_m(before, m.id));
  }
  return measured;
}

TEST(SolveFix, LeavesOutDopplersThatContradictTheOthers) {
  const std::vector<Measurement> right = measure_with_dopplers();
  const Fix fix = solve_fix(kTime, right, four_systems(), FixOptions{});
  ASSERT_TRUE(fix.velocity_enu_mps);
  EXPECT_LT(fix.velocity_enu_mps->norm(), 1e-3);
  EXPECT_TRUE(fix.excluded.empty());
  for (const double hz : {5.0, 50.0, 1000.0}) {
    for (const std::size_t count : {1U, 3U}) {
      std::vector<Measurement> wrong = right;
      std::vector<gnss::SatelliteId> ids;
      for (std::size_t i = 0; i < count; ++i) {
        *wrong[i].doppler_hz += hz * (i % 3 == 0 ? 1.0 : -1.5);
        ids.push_back(wrong[i].id);
      }
      const Fix robust = solve_fix(kTime, wrong, four_systems(), FixOptions{});
      EXPECT_LT(robust.velocity_enu_mps.value().norm(), 1e-3) << hz << ' ' << count;
      EXPECT_THAT(robust.excluded, testing::UnorderedElementsAreArray(ids)) << hz;
      EXPECT_EQ(robust.used, fix.used) << "its place is right";
      EXPECT_EQ(robust.position_ecef, fix.position_ecef);
    }
  }
}

// With five, the wrong one is not identified, but the deviation shows that one is wrong.
TEST(SolveFix, StatesWhatContradictingDopplersAreWorth) {
  std::vector<Measurement> five = only(measure_with_dopplers(), System::GPS, 5);
  const double sigma_mps =
      std::sqrt(solve_fix(kTime, five, four_systems(), FixOptions{}).velocity_covariance_enu->trace());
  *five[2].doppler_hz += 50;
  const Fix fix = solve_fix(kTime, five, four_systems(), FixOptions{});
  EXPECT_TRUE(fix.excluded.empty());
  EXPECT_GT(fix.velocity_enu_mps->norm(), 10 * sigma_mps);
  EXPECT_GT(std::sqrt(fix.velocity_covariance_enu->trace()), 2 * sigma_mps);
}

void expect_unsolved(const Fix& fix) {
  EXPECT_FALSE(fix.solved());
  EXPECT_EQ(name(fix.status), "no fix");
  EXPECT_EQ(fix.kind(), FixKind::None);
  EXPECT_TRUE(fix.position_ecef.array().isNaN().all());
  EXPECT_TRUE(std::isnan(fix.position.latitude_rad) && std::isnan(fix.position.height_m));
  EXPECT_TRUE(fix.covariance_enu.array().isNaN().all());
  EXPECT_FALSE(fix.dop || fix.velocity_enu_mps || fix.clock_drift);
  EXPECT_TRUE(fix.used.empty() && fix.residuals_m.empty() && fix.clock_bias_s.empty());
}

TEST(FixKind, FollowsFromStatusAndSatellites) {
  Fix fix;
  fix.solution = FixKind::Fixed;
  EXPECT_EQ(fix.kind(), FixKind::None) << "whatever its members hold";
  fix.status = FixStatus::Fix;
  EXPECT_EQ(fix.kind(), FixKind::DeadReckoning);
  fix.used = {{System::GPS, 1}};
  EXPECT_EQ(fix.kind(), FixKind::Fixed);
  fix.status = FixStatus::WeakGeometry;
  EXPECT_EQ(fix.kind(), FixKind::None);

  const Fix least_squares = solve_fix(kTime, measure(four_systems()), four_systems(), FixOptions{});
  EXPECT_EQ(least_squares.kind(), FixKind::Single);
  EXPECT_FALSE(least_squares.correction_age_s || least_squares.correction_station);
}

TEST(FixKind, Words) {
  EXPECT_EQ(name(FixKind::None), "none");
  EXPECT_EQ(name(FixKind::Single), "single");
  EXPECT_EQ(name(FixKind::Differential), "differential");
  EXPECT_EQ(name(FixKind::Float), "float");
  EXPECT_EQ(name(FixKind::Fixed), "fixed");
  EXPECT_EQ(name(FixKind::DeadReckoning), "dead reckoning");
}

TEST(SolveFix, TooFewSatellitesSaysWhatThereWas) {
  expect_unsolved(Fix{});
  const Fix none = solve_fix(kTime, {}, four_systems(), FixOptions{});
  expect_unsolved(none);
  EXPECT_EQ(none.status, FixStatus::TooFewSatellites);
  EXPECT_EQ(none.available, 0);
  const Fix three =
      solve_fix(kTime, only(measure(four_systems()), System::GPS, 3), four_systems(), FixOptions{});
  expect_unsolved(three);
  EXPECT_EQ(three.available, 3);
  EXPECT_EQ(three.unknowns, 4);
}

TEST(SolveFix, SatellitesUnknownToTheSkyAreLeftOut) {
  std::vector<Measurement> measurements = measure(four_systems());
  const std::size_t known = measurements.size();
  Measurement stranger = measurements.front();
  stranger.id = {System::QZSS, 3};
  measurements.push_back(stranger);
  const Fix fix = solve_fix(kTime, measurements, four_systems(), FixOptions{});
  ASSERT_TRUE(fix.solved());
  EXPECT_EQ(fix.used.size(), known);
}

// All satellites at one elevation: height and clock cannot be separated (dop_test has the closed form).
TEST(SolveFix, ConeOfSatellitesIsSingular) {
  const std::vector<double> elevation(7, geodesy::radians(40));
  const std::vector<std::vector<double>> azimuths{{0, 0.9, 1.8, 2.7, 3.6, 4.5, 5.4},
                                                  {0, 0.2, 0.5, 2.7, 3.1, 4.5, 5}};
  for (const auto& azimuth : azimuths) {
    const orbit::FrozenSky sky(kPosition, azimuth, elevation);
    const Fix fix = solve_fix(kTime, measure(sky), sky, FixOptions{});
    expect_unsolved(fix);
    EXPECT_EQ(fix.status, FixStatus::Singular) << reason(fix.status);
    EXPECT_LT(fix.rank, fix.unknowns);
  }
}

TEST(SolveFix, AllSatellitesInOneDirectionIsSingular) {
  const orbit::FrozenSky sky(kPosition, std::vector<double>(6, 1.0), std::vector<double>(6, 0.8));
  const Fix fix = solve_fix(kTime, measure(sky), sky, FixOptions{});
  expect_unsolved(fix);
  EXPECT_EQ(fix.status, FixStatus::Singular);
}

// Four pseudoranges have two exact solutions. Newton's method from the Earth's centre or from deep space
// sometimes converges to the other one, or diverges.
TEST(SolveFix, FourSatellitesLeadToTheTruthFromAnywhere) {
  RandomStream random(5, "start");
  for (int epoch = 0; epoch < 500; ++epoch) {
    const GpsTime time = kTime + 600.0 * epoch;
    std::vector<Measurement> four = measure(four_systems(), time);
    four.resize(4);  // GPS: the first of the sky
    ASSERT_EQ(four.back().id.system, System::GPS);
    std::vector<Eigen::Vector3d> directions;
    for (const Measurement& m : four) {
      directions.push_back(orbit::line_of_sight(four_systems(), m.id, time, kTruth)->direction_ecef);
    }
    const auto dop = dop_of_directions(directions);
    if (!dop || dop->gdop > 200) continue;
    const Eigen::Vector3d space = 6e7 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    for (const Eigen::Vector3d& start : {Eigen::Vector3d(0, 0, 0), space}) {
      const Fix fix = solve_fix(time, four, four_systems(), FixOptions{}, {}, start);
      ASSERT_TRUE(fix.solved()) << reason(fix.status) << ", GDOP " << dop->gdop << ", epoch " << epoch;
      EXPECT_LT((fix.position_ecef - kTruth).norm(), 1e-6 * dop->gdop);
    }
  }
}

// Pseudoranges of an antenna 2000 km above the ground.
TEST(SolveFix, PlaceFarFromTheGroundIsNoFix) {
  const Eigen::Vector3d high = kTruth * (1 + 2e6 / kTruth.norm());
  std::vector<Measurement> measurements = measure(four_systems(), kTime, 30);
  for (Measurement& m : measurements) {
    const auto line = orbit::line_of_sight(four_systems(), m.id, kTime, high);
    m.pseudorange_m = line->range_m - kSpeedOfLight * (line->state.clock_bias_s - line->state.group_delay_s);
  }
  const Fix fix = solve_fix(kTime, measurements, four_systems(), FixOptions{});
  expect_unsolved(fix);
  EXPECT_EQ(fix.status, FixStatus::NotConverged);
  EXPECT_GT(fix.iterations, 0);
  EXPECT_EQ(fix.rank, fix.unknowns);
}

TEST(SolveFix, AbsurdMeasurementsDoNotPretendAFix) {
  std::vector<Measurement> measurements = only(measure(four_systems()), System::GPS, 4);
  RandomStream random(4, "absurd");
  for (int run = 0; run < 200; ++run) {
    std::vector<Measurement> wild = measurements;
    for (Measurement& m : wild) m.pseudorange_m = 4e7 * random.uniform();
    const Fix fix = solve_fix(kTime, wild, four_systems(), FixOptions{});
    if (fix.solved()) {
      EXPECT_GE(fix.position.height_m, -1e4);
      EXPECT_LE(fix.position.height_m, 1e5);
    } else {
      expect_unsolved(fix);
    }
  }
}

// Pseudoranges without an ionosphere, corrected by a model: the fix is wrong by the whole model, and its
// reported deviation for the half that a model may leave is half of that error. Sigmas of 100 m make the
// residuals uninformative.
TEST(SolveFix, StatesWhatTheModelOfTheIonosphereMayLeave) {
  std::vector<Measurement> measurements = measure(four_systems());
  for (Measurement& m : measurements) m.sigma_m = 100;
  gnss::Klobuchar model;
  model.alpha = {2e-8, 0, 0, 0};
  model.beta = {1e5, 0, 0, 0};
  FixOptions options;
  options.correct_ionosphere = true;
  const Fix plain = solve_fix(kTime, measurements, four_systems(), options, {{System::GPS, model}});
  options.covariance_by_residuals = true;
  const Fix stating = solve_fix(kTime, measurements, four_systems(), options, {{System::GPS, model}});
  ASSERT_TRUE(plain.solved() && stating.solved());
  const Eigen::Vector3d error = geodesy::enu_from_ecef_rotation(kPosition) * (stating.position_ecef - kTruth);
  EXPECT_GT(std::abs(error.z()), 5);
  const Eigen::Matrix3d expected = error * error.transpose() / 4;
  EXPECT_LT((stating.covariance_enu - plain.covariance_enu - expected).norm(), 0.01 * expected.norm());
  // Corrections replace the model.
  for (Measurement& m : measurements) m.reported_sigma_ratio = 0.5;
  options.covariance_by_residuals = false;
  const Fix corrected = solve_fix(kTime, measurements, four_systems(), options, {{System::GPS, model}});
  options.covariance_by_residuals = true;
  const Fix reported = solve_fix(kTime, measurements, four_systems(), options, {{System::GPS, model}});
  EXPECT_LT((reported.covariance_enu - corrected.covariance_enu).norm(),
            1e-6 * reported.covariance_enu.norm());
}

TEST(SolveFix, RefusesWhatIsNoMeasurement) {
  const std::vector<Measurement> good = measure(four_systems());
  const auto message = [&](auto&& spoil) {
    std::vector<Measurement> bad = good;
    spoil(bad);
    return test::refusal([&] { static_cast<void>(solve_fix(kTime, bad, four_systems(), FixOptions{})); });
  };
  using List = std::vector<Measurement>;
  const std::string sat = gnss::to_string(good[2].id);
  EXPECT_EQ(message([](List&) {}), "");
  EXPECT_THAT(message([](List& m) { m[2].pseudorange_m = std::nan(""); }),
              testing::AllOf(testing::HasSubstr("pseudorange_m"), testing::HasSubstr(sat)));
  EXPECT_THAT(message([](List& m) { m[2].sigma_m = 0; }), testing::HasSubstr("sigma_m"));
  EXPECT_THAT(message([](List& m) { m[2].doppler_hz = INFINITY; }), testing::HasSubstr("doppler_hz"));
  EXPECT_THAT(message([](List& m) {
                m[2].doppler_hz = 1;
                m[2].carrier_frequency_hz = 0;
              }),
              testing::HasSubstr("carrier_frequency_hz"));
  EXPECT_THAT(message([](List& m) {
                m[2].doppler_hz = 1;
                m[2].doppler_sigma_hz = -1;
              }),
              testing::HasSubstr("doppler_sigma_hz"));
  EXPECT_THAT(message([](List& m) { m.push_back(m[2]); }),
              testing::AllOf(testing::HasSubstr("twice"), testing::HasSubstr(sat)));
  EXPECT_THROW(static_cast<void>(solve_fix(kTime, good, four_systems(), FixOptions{}, {},
                                           Eigen::Vector3d::Constant(std::nan("")))),
               InputError);
  FixOptions ionosphere;
  ionosphere.correct_ionosphere = true;
  EXPECT_THROW(static_cast<void>(solve_fix(kTime, good, four_systems(), ionosphere)), InputError);
}

TEST(FixOptions, NamesTheFieldThatIsOutOfRange) {
  const test::SpoiledOptions<FixOptions> message;
  EXPECT_EQ(message([](FixOptions&) {}), "");
  EXPECT_EQ(message([](FixOptions& o) { o.elevation_mask_rad = 0; }), "");
  EXPECT_THAT(message([](FixOptions& o) { o.elevation_mask_rad = 15; }),
              testing::HasSubstr("elevation_mask_rad"));
  EXPECT_THAT(message([](FixOptions& o) { o.elevation_mask_rad = -0.1; }),
              testing::HasSubstr("elevation_mask_rad"));
  EXPECT_THAT(message([](FixOptions& o) { o.elevation_mask_rad = std::nan(""); }),
              testing::HasSubstr("elevation_mask_rad"));
  EXPECT_THAT(message([](FixOptions& o) { o.min_satellites = 3; }), testing::HasSubstr("min_satellites"));
  EXPECT_THAT(message([](FixOptions& o) { o.max_iterations = 0; }), testing::HasSubstr("max_iterations"));
  EXPECT_THAT(message([](FixOptions& o) { o.convergence_m = 0; }), testing::HasSubstr("convergence_m"));
}

}  // namespace
}  // namespace canyon::positioning
