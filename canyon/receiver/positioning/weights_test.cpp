// Weights, masks and geometry limits of the fix.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/sky/range_errors.hpp"
#include "tests/support/circular_sky.hpp"
#include "tests/support/spoiled_options.hpp"
#include "tests/support/test_drive.hpp"

namespace canyon::positioning::weights_test {
namespace {

using geodesy::GpsTime;
using gnss::System;
using test::CircularSky;
using test::TestDrive;

const geodesy::Geodetic kPosition = geodesy::Geodetic::from_degrees(22.3, 114.18, 30);
constexpr GpsTime kTime = CircularSky::kEpoch + std::chrono::hours(5);

const CircularSky& sky() {
  static const CircularSky sky({System::GPS, System::Galileo});
  return sky;
}

TEST(Weighting, HasTheWordsOfScenarios) {
  EXPECT_EQ(name(Weighting::Sigma), "sigma");
  EXPECT_EQ(name(Weighting::Equal), "equal");
  EXPECT_EQ(name(Weighting::Elevation), "elevation");
  EXPECT_EQ(name(Weighting::Cn0), "cn0");
}

TEST(WeightOptions, SigmaIsTheFormulas) {
  Measurement m;
  m.sigma_m = 2.5;
  WeightOptions options;
  EXPECT_EQ(options.sigma_m(m, 0.1), 2.5);
  options.weighting = Weighting::Equal;
  EXPECT_EQ(options.sigma_m(m, 0.1), 2.5);
  options.weighting = Weighting::Elevation;
  EXPECT_NEAR(options.sigma_m(m, geodesy::radians(90)), 0.3 * std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(options.sigma_m(m, geodesy::radians(30)), 0.3 * std::sqrt(5.0), 1e-12);  // sin 30 deg = 1/2
  options.elevation_b_m = 0.6;
  EXPECT_NEAR(options.sigma_m(m, geodesy::radians(30)), 0.3 * std::sqrt(17.0), 1e-12);
  EXPECT_EQ(options.sigma_m(m, geodesy::radians(-3)), options.sigma_m(m, geodesy::radians(5)));
  options.weighting = Weighting::Cn0;
  EXPECT_NEAR(options.sigma_m(m, 1), std::sqrt(10 + 22.5), 1e-12);  // none: 30 dB-Hz
  m.cn0_dbhz = 30;
  EXPECT_NEAR(options.sigma_m(m, 1), std::sqrt(32.5), 1e-12);
  m.cn0_dbhz = 20;
  EXPECT_NEAR(options.sigma_m(m, 1), std::sqrt(10 + 225.0), 1e-12);
  m.cn0_dbhz = 50;
  EXPECT_NEAR(options.sigma_m(m, 1), std::sqrt(10 + 0.225), 1e-12);
}

/// The weighted least-squares result at the truth, computed with the inverse: position error [ENU] and
/// covariance; and PDOP of unit weights.
struct Expected {
  Eigen::Vector3d error;
  Eigen::Matrix3d covariance;
  double pdop = 0;
};
Expected expected(const std::vector<Measurement>& measurements, const std::vector<double>& noise,
                  const std::vector<double>& sigma) {
  const auto rows = static_cast<Eigen::Index>(measurements.size());
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(rows, 5);
  Eigen::VectorXd weight(rows), error(rows);
  const Eigen::Vector3d truth = geodesy::ecef_from_geodetic(kPosition);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const auto line = orbit::line_of_sight(sky(), measurements[k].id, kTime, truth);
    a.block<1, 3>(i, 0) = -(geodesy::enu_from_ecef_rotation(kPosition) * line->direction_ecef).transpose();
    a(i, measurements[k].id.system == System::GPS ? 3 : 4) = 1;
    weight(i) = 1 / (sigma[k] * sigma[k]);
    error(i) = noise[k];
  }
  const Eigen::MatrixXd covariance = (a.transpose() * weight.asDiagonal() * a).inverse();
  const Eigen::VectorXd x = covariance * a.transpose() * weight.asDiagonal() * error;
  const Eigen::MatrixXd unit = (a.transpose() * a).inverse();
  return {x.head<3>(), covariance.topLeftCorner<3, 3>(), std::sqrt(unit.diagonal().head<3>().sum())};
}

TEST(SolveFix, EveryWeightingGivesItsLeastSquares) {
  TestDrive drive(sky(), kTime, kPosition, 1);
  drive.sigma_m = 0;
  drive.doppler = false;
  const std::vector<Measurement> exact = drive.measure();
  RandomStream random(2, "noise");
  for (const Weighting weighting :
       {Weighting::Sigma, Weighting::Equal, Weighting::Elevation, Weighting::Cn0}) {
    FixOptions options;
    options.weights.weighting = weighting;
    std::vector<Measurement> measurements = exact;
    std::vector<double> noise, sigma;
    double squares = 0;
    for (Measurement& m : measurements) {
      m.sigma_m = 1 + random.uniform();
      m.cn0_dbhz = 25 + 25 * random.uniform();
      noise.push_back(3 * random.normal());
      m.pseudorange_m += noise.back();
      squares += m.sigma_m * m.sigma_m;
    }
    for (const Measurement& m : measurements) {
      const double el = drive.elevation_rad(m.id);
      switch (weighting) {
        case Weighting::Sigma:
          sigma.push_back(m.sigma_m);
          break;
        case Weighting::Equal:
          sigma.push_back(std::sqrt(squares / static_cast<double>(measurements.size())));
          break;
        case Weighting::Elevation:
          sigma.push_back(std::sqrt(0.09 + 0.09 / std::pow(std::sin(el), 2)));
          break;
        case Weighting::Cn0:
          sigma.push_back(std::sqrt(10 + 22'500 * std::pow(10, -*m.cn0_dbhz / 10)));
          break;
      }
    }
    const Fix fix = solve_fix(kTime, measurements, sky(), options);
    ASSERT_TRUE(fix.solved());
    ASSERT_EQ(fix.used.size(), measurements.size());
    const Expected result = expected(measurements, noise, sigma);
    EXPECT_LT((drive.error_enu(fix) - result.error).norm(), 1e-4) << name(weighting);
    EXPECT_LT((fix.covariance_enu - result.covariance).norm(), 1e-5 * result.covariance.norm())
        << name(weighting);
    EXPECT_NEAR(fix.dop->pdop, result.pdop, 1e-5) << name(weighting);
  }
}

// The weights depend on the elevation at the final position, not at the start.
TEST(SolveFix, ElevationWeightsDoNotDependOnTheStart) {
  TestDrive drive(sky(), kTime, kPosition, 3);
  const std::vector<Measurement> measurements = drive.measure();
  FixOptions options;
  options.weights.weighting = Weighting::Elevation;
  const Fix fix = solve_fix(kTime, measurements, sky(), options);
  const Fix other =
      solve_fix(kTime, measurements, sky(), options, {}, drive.position() + Eigen::Vector3d(2e6, -1e6, 1e6));
  ASSERT_TRUE(fix.solved() && other.solved());
  EXPECT_LT((fix.position_ecef - other.position_ecef).norm(), 1e-6);
  EXPECT_LT((fix.covariance_enu - other.covariance_enu).norm(), 1e-9);
  EXPECT_LE(fix.iterations, 9);
}

TEST(SolveFix, SignalsBelowTheCn0MaskAreLeftOut) {
  TestDrive drive(sky(), kTime, kPosition, 4);
  std::vector<Measurement> measurements = drive.measure();
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    if (i % 4 != 1) measurements[i].cn0_dbhz = i % 4 == 0 ? 24.9 : 25;
  }
  FixOptions options;
  options.cn0_mask_dbhz = 25;
  const Fix fix = solve_fix(kTime, measurements, sky(), options);
  ASSERT_TRUE(fix.solved());
  std::vector<gnss::SatelliteId> kept;
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    if (i % 4 != 0) kept.push_back(measurements[i].id);
  }
  EXPECT_EQ(fix.used, kept);
  EXPECT_EQ(fix.available, static_cast<int>(kept.size()));
}

TEST(SolveFix, PdopBeyondTheLimitIsNoFix) {
  TestDrive drive(sky(), kTime, kPosition, 5);
  const std::vector<Measurement> measurements = drive.measure();
  const Fix any = solve_fix(kTime, measurements, sky(), FixOptions{});
  ASSERT_TRUE(any.solved() && any.dop);
  FixOptions options;
  options.max_pdop = any.dop->pdop * 1.0001;
  const Fix good = solve_fix(kTime, measurements, sky(), options);
  EXPECT_EQ(good.position_ecef, any.position_ecef);
  options.max_pdop = any.dop->pdop * 0.9999;
  const Fix weak = solve_fix(kTime, measurements, sky(), options);
  EXPECT_EQ(weak.status, FixStatus::WeakGeometry);
  EXPECT_EQ(name(weak.status), "no fix");
  EXPECT_EQ(reason(weak.status), "satellite geometry is too weak");
  EXPECT_TRUE(weak.position_ecef.array().isNaN().all() && weak.covariance_enu.array().isNaN().all());
  EXPECT_TRUE(weak.used.empty() && weak.residuals_m.empty() && weak.clock_bias_s.empty());
  EXPECT_FALSE(weak.dop || weak.velocity_enu_mps || weak.clock_drift);
  EXPECT_EQ(weak.available, any.available);
  EXPECT_EQ(weak.rank, any.rank);
}

TEST(SolveFix, RefusesACn0ThatIsNoNumber) {
  TestDrive drive(sky(), kTime, kPosition, 6);
  std::vector<Measurement> measurements = drive.measure();
  measurements[1].cn0_dbhz = std::numeric_limits<double>::infinity();
  try {
    static_cast<void>(solve_fix(kTime, measurements, sky(), FixOptions{}));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(std::string(error.what()), testing::HasSubstr("cn0_dbhz"));
  }
}

TEST(FixOptions, NamesTheNewFieldThatIsOutOfRange) {
  const test::SpoiledOptions<FixOptions> message;
  using Options = FixOptions;
  EXPECT_EQ(message([](Options&) {}), "");
  EXPECT_THAT(message([](Options& o) { o.cn0_mask_dbhz = -1; }), testing::HasSubstr("cn0_mask_dbhz"));
  EXPECT_THAT(message([](Options& o) { o.cn0_mask_dbhz = 61; }), testing::HasSubstr("cn0_mask_dbhz"));
  EXPECT_THAT(message([](Options& o) { o.max_pdop = 0; }), testing::HasSubstr("max_pdop"));
  EXPECT_THAT(message([](Options& o) { o.max_pdop = std::nan(""); }), testing::HasSubstr("max_pdop"));
  EXPECT_THAT(message([](Options& o) { o.weights.elevation_a_m = 0; }), testing::HasSubstr("elevation_a_m"));
  EXPECT_THAT(message([](Options& o) { o.weights.elevation_b_m = -1; }), testing::HasSubstr("elevation_b_m"));
}

}  // namespace
}  // namespace canyon::positioning::weights_test
