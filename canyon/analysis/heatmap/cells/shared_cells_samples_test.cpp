// Layers over noise realizations.

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "canyon/analysis/heatmap/cells/shared_cells.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/receiver/tracking/noise.hpp"
#include "tests/support/tile_scene.hpp"

namespace canyon::heatmap {
namespace {

using geodesy::Geodetic;
using gnss::System;
using receiver::ReceiverOptions;
using test::Maps;
using test::solve;
using test::TileScene;

const Geodetic kHongKong = Geodetic::from_degrees(22.3, 114.18, 30);
const std::vector<System> kGps{System::GPS};
const std::vector<System> kThree{System::GPS, System::Galileo, System::BeiDou};

ReceiverOptions quiet() {
  ReceiverOptions options;
  options.noise.enabled = false;
  return options;
}

/// K of unit weights for a cell's received satellites, one clock, computed with the inverse; ENU of the
/// tile's centre.
Eigen::MatrixXd gain(const TileScene& scene, std::size_t cell, std::vector<std::size_t>& received) {
  for (std::size_t k = 0; k < scene.signals.satellites.size(); ++k) {
    if (scene.signals.visibility[k][cell] != CellVisibility::Blocked) received.push_back(k);
  }
  Eigen::MatrixXd h(received.size(), 4);
  for (std::size_t row = 0; row < received.size(); ++row) {
    const orbit::LineOfSight& line = scene.signals.satellites[received[row]];
    h.row(static_cast<Eigen::Index>(row))
        << -geodesy::enu_from_azimuth_elevation(line.azimuth_rad, line.elevation_rad).transpose(),
        1;
  }
  return ((h.transpose() * h).inverse() * h.transpose()).topRows(3);
}

// RMS^2 = |K m|^2 + trace(K K^T) sigma^2, over the directions in question; and the half-normal distribution
// of the vertical error without reflections: mean sqrt(2 / pi) s, p50 0.67449 s, p95 1.95996 s (NIST
// e-Handbook, 1.3.6.7.1). The standard error of each is below 1.2 % at 10,000 samples.
TEST(SharedCells, DrawsHaveTheClosedFormsMoments) {
  TileScene scene(kGps, kHongKong);
  scene.lay({0, 0}, 2, 6, 1, 15);
  ReceiverOptions options;
  options.noise.ou.theta_per_s = 0.05;
  options.noise.ou.sigma_m_per_sqrt_s = 1.2;
  const double sigma = 1.2 / std::sqrt(0.1);
  scene.compute_sky(options.fix.elevation_mask_rad);
  scene.receive(1, 0, 0, 8);
  for (std::size_t k = 0; k < 3; ++k) {
    scene.signals.visibility[2 * k][k + 3] = CellVisibility::NLOS;
    scene.signals.excess_m[2 * k][k + 3] = 25;
  }
  const std::vector<Layer> wanted{Layer::HorizontalErrorRms,
                                  Layer::VerticalErrorRms,
                                  Layer::VerticalErrorMean,
                                  Layer::VerticalErrorP50,
                                  Layer::VerticalErrorP95,
                                  Layer::Vdop,
                                  Layer::Hdop};
  const Maps maps = solve(SharedReceiver{options, {10'000, 5}, {}, {}}, scene, wanted);
  for (std::size_t cell = 0; cell < 6; ++cell) {
    std::vector<std::size_t> received;
    const Eigen::MatrixXd k = gain(scene, cell, received);
    Eigen::VectorXd m(received.size());
    for (std::size_t row = 0; row < received.size(); ++row) {
      m(static_cast<Eigen::Index>(row)) = static_cast<double>(scene.signals.excess_m[received[row]][cell]);
    }
    const Eigen::Vector3d fixed = k * m;
    const Eigen::Matrix3d spread = sigma * sigma * k * k.transpose();
    const double horizontal = std::sqrt(fixed.head<2>().squaredNorm() + spread(0, 0) + spread(1, 1));
    EXPECT_NEAR(maps[0][cell], horizontal, 0.03 * horizontal);
    const double s = std::sqrt(spread(2, 2)), vertical = std::hypot(fixed.z(), s);
    EXPECT_NEAR(maps[1][cell], vertical, 0.03 * vertical);
    EXPECT_NEAR(maps[5][cell], s / sigma, 1e-5 * s / sigma);
    EXPECT_NEAR(maps[6][cell], std::sqrt(spread(0, 0) + spread(1, 1)) / sigma, 1e-5 * s);
    if (cell >= 3) continue;
    EXPECT_NEAR(maps[2][cell], std::sqrt(2 / geodesy::kPi) * s, 0.03 * s);
    EXPECT_NEAR(maps[3][cell], 0.67449 * s, 0.03 * s);
    EXPECT_NEAR(maps[4][cell], 1.95996 * s, 0.06 * s);
  }
  EXPECT_NEAR(maps[0][0], maps[0][1], 1e-4);  // common random numbers
}

/// Probability that a normal error, with deviations a and b along the axes of its ellipse, is longer than
/// `limit`: the integral over directions of s^2 exp(-limit^2 / (2 s^2)) / (2 pi a b), 1/s^2 = cos^2/a^2 +
/// sin^2/b^2.
double fraction_beyond(double a, double b, double limit) {
  double sum = 0;
  constexpr int kSteps = 3600;
  for (int i = 0; i < kSteps; ++i) {
    const double angle = 2 * geodesy::kPi * i / kSteps;
    const double s2 = 1 / (std::pow(std::cos(angle) / a, 2) + std::pow(std::sin(angle) / b, 2));
    sum += s2 * std::exp(-limit * limit / (2 * s2)) / (a * b);
  }
  return sum / kSteps;
}

// Without reflections, errors are normal with sigma^2 K K^T: the level is K times its larger half axis, and
// fractions beyond limits are those of the bivariate normal distribution, 10,000 samples each (standard error
// below 0.5 %).
TEST(SharedCells, LimitsAreExceededAsOftenAsTheNormalDistributionSays) {
  TileScene scene(kThree, kHongKong);
  scene.lay({0, 0}, 2, 3, 1, 15);
  ReceiverOptions options;
  options.noise.ou.theta_per_s = 0.05;
  options.noise.ou.sigma_m_per_sqrt_s = 1.2;
  const double sigma = 1.2 / std::sqrt(0.1);
  scene.compute_sky(options.fix.elevation_mask_rad);
  scene.receive(1, 0, 0, 8);
  LimitOptions limits;
  limits.error_m = 3;
  limits.protection_factor = 1.5;
  const std::vector<Layer> wanted{Layer::ProtectionLevel, Layer::HorizontalErrorExceedance,
                                  Layer::MisleadingFraction, Layer::ProtectedAvailability};
  std::vector<Eigen::Index> column;
  std::vector<System> systems;
  for (const orbit::LineOfSight& line : scene.signals.satellites) {
    const System system = line.id.system;
    auto found = std::find(systems.begin(), systems.end(), system);
    if (found == systems.end()) found = systems.insert(systems.end(), system);
    column.push_back(3 + (found - systems.begin()));
  }
  const auto rows = static_cast<Eigen::Index>(column.size());
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(rows, 3 + static_cast<Eigen::Index>(systems.size()));
  for (Eigen::Index row = 0; row < rows; ++row) {
    const auto i = static_cast<std::size_t>(row);
    const orbit::LineOfSight& line = scene.signals.satellites[i];
    h.row(row).head<3>() =
        -geodesy::enu_from_azimuth_elevation(line.azimuth_rad, line.elevation_rad).transpose();
    h(row, column[i]) = 1;
  }
  const Eigen::Matrix2d spread = (sigma * sigma * (h.transpose() * h).inverse()).topLeftCorner<2, 2>();
  const Eigen::Vector2d axes =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(spread).eigenvalues().cwiseSqrt();
  limits.alert_m = 1.5 * axes[1] + 0.01;
  const Maps maps = solve(SharedReceiver{options, {10'000, 5}, {}, limits}, scene, wanted);
  EXPECT_NEAR(maps[0][1], 1.5 * axes[1], 1e-3 * axes[1]);
  EXPECT_NEAR(maps[1][1], fraction_beyond(axes[0], axes[1], 3), 0.02);
  EXPECT_NEAR(maps[2][1], fraction_beyond(axes[0], axes[1], 1.5 * axes[1]), 0.02);
  EXPECT_EQ(maps[3][1], 1);
  limits.alert_m = 1.5 * axes[1] - 0.01;
  const Maps strict = solve(SharedReceiver{options, {100, 5}, {}, limits}, scene, wanted);
  EXPECT_EQ(strict[3][1], 0);
}

// One realization is the fix of measurements with noise of each satellite's own stream, also in a
// troposphere.
TEST(SharedCells, ADrawIsTheFixOfItsNoise) {
  for (const int route : {0, 1}) {
    TileScene scene(kThree, kHongKong);
    scene.lay({0, 0}, 25, 10, 10, 15);
    ReceiverOptions options;
    options.noise.ou.sigma_m_per_sqrt_s = 2;
    options.troposphere = options.fix.correct_troposphere = route == 1;
    scene.compute_sky(options.fix.elevation_mask_rad);
    scene.receive(0.4, 0.3, 250, 15);
    std::vector<double> noise_m;
    for (const orbit::LineOfSight& line : scene.signals.satellites) {
      RandomStream stream(
          6, "heatmap/" + to_string(line.id) + "/" + std::to_string(scene.time.nanoseconds()) + "/code");
      noise_m.push_back(2 / std::sqrt(0.04) * stream.normal());
    }
    const Maps maps = solve(SharedReceiver{options, {1, 6}, {}, {}}, scene,
                            {Layer::HorizontalErrorMean, Layer::VerticalErrorP95, Layer::Pdop});
    int fixes = 0, fewer = 0;
    double worst = 0;
    for (std::size_t i = 0; i < 100; ++i) {
      const TileScene::Result result = scene.reference_fix(i, options, noise_m);
      if (!result.fix.solved() || !(maps[2][i] < 100)) continue;
      if (std::hypot(result.horizontal_m, result.vertical_m) > 1000) continue;
      ++fixes;
      fewer += result.fix.used.size() < scene.signals.satellites.size();
      const double apart_m = std::max(std::abs(double{maps[0][i]} - result.horizontal_m),
                                      std::abs(double{maps[1][i]} - std::abs(result.vertical_m)));
      worst = std::max(worst, apart_m / std::max(1.0, std::hypot(result.horizontal_m, result.vertical_m)));
    }
    std::printf("  %d fixes (%d of fewer satellites) within %.1e of the error\n", fixes, fewer, worst);
    EXPECT_GT(fixes, 70);
    EXPECT_LT(worst, route == 0 ? 1e-3 : 5e-3);
  }
}

// The first samples do not depend on their number, so that each can be computed from two means; their
// quantiles by sorting.
TEST(SharedCells, QuantilesAreThoseOfTheDraws) {
  TileScene scene(kGps, kHongKong);
  scene.lay({0, 0}, 40, 3, 3, 15);
  scene.compute_sky(quiet().fix.elevation_mask_rad);
  scene.receive(0.7, 0.3, 80, 9);
  const std::vector<Layer> wanted{Layer::HorizontalErrorMean, Layer::HorizontalErrorP50,
                                  Layer::HorizontalErrorP95,  Layer::VerticalErrorMean,
                                  Layer::VerticalErrorP50,    Layer::VerticalErrorP95,
                                  Layer::HorizontalErrorRms};
  constexpr int kSamples = 12;
  std::vector<Maps> maps;
  for (int sample_count = 1; sample_count <= kSamples; ++sample_count) {
    maps.push_back(solve(SharedReceiver{{}, {sample_count, 3}, {}, {}}, scene, wanted));
  }
  for (std::size_t cell = 0; cell < 9; ++cell) {
    for (const std::size_t layer : {std::size_t{0}, std::size_t{3}}) {
      std::vector<double> values;
      double squares = 0;
      for (int sample_count = 1; sample_count <= kSamples; ++sample_count) {
        const auto i = static_cast<std::size_t>(sample_count - 1);
        const double before = sample_count == 1 ? 0 : (sample_count - 1) * double{maps[i - 1][layer][cell]};
        values.push_back(sample_count * double{maps[i][layer][cell]} - before);
        squares += values.back() * values.back();
        std::vector<double> sorted = values;
        std::sort(sorted.begin(), sorted.end());
        const auto type7 = [&](double p) {
          const double rank = p * (sample_count - 1);
          const auto low = static_cast<std::size_t>(rank);
          const std::size_t high = std::min(low + 1, sorted.size() - 1);
          return sorted[low] + (rank - std::floor(rank)) * (sorted[high] - sorted[low]);
        };
        EXPECT_NEAR(maps[i][layer + 1][cell], type7(0.5), 1e-3);
        EXPECT_NEAR(maps[i][layer + 2][cell], type7(0.95), 1e-3);
        if (layer == 0) {
          EXPECT_NEAR(maps[i][6][cell], std::sqrt(squares / sample_count), 1e-3);
        }
      }
      EXPECT_GT(*std::max_element(values.begin(), values.end()),
                *std::min_element(values.begin(), values.end()) + 0.1);
    }
  }
}

TEST(SharedCells, DrawsFollowSeedAndTimeAlone) {
  TileScene scene(kGps, kHongKong);
  scene.lay({0, 0}, 2, 4, 4, 15);
  scene.compute_sky(quiet().fix.elevation_mask_rad);
  scene.receive(1, 0, 0, 10);
  const std::vector<Layer> wanted{Layer::HorizontalErrorP95};
  const auto draw = [&](std::uint64_t seed) {
    return solve(SharedReceiver{{}, {20, seed}, {}, {}}, scene, wanted)[0];
  };
  const std::vector<float> first = draw(1);
  EXPECT_EQ(first, draw(1));
  EXPECT_NE(first, draw(2));
  scene.time = scene.time + 1.0;
  scene.compute_sky(quiet().fix.elevation_mask_rad);
  scene.receive(1, 0, 0, 10);
  EXPECT_GT(std::abs(first[0] - draw(1)[0]), 1e-3F);
}

// Without noise all realizations equal the fix itself; a common mean changes only the clock.
TEST(SharedCells, DrawsOfNoNoiseAreTheFix) {
  TileScene scene(kThree, kHongKong);
  scene.lay({0, 0}, 20, 10, 10, 15);
  scene.compute_sky(quiet().fix.elevation_mask_rad);
  scene.receive(0.3, 0.2, 250, 11);
  const std::vector<Layer> wanted{Layer::HorizontalError, Layer::HorizontalErrorMean,
                                  Layer::HorizontalErrorP95, Layer::VerticalError, Layer::VerticalErrorRms};
  const Maps still = solve(SharedReceiver{quiet(), {}, {}, {}}, scene, wanted);
  ReceiverOptions options;
  options.noise.ou.mu_m = 4;
  options.noise.ou.sigma_m_per_sqrt_s = 0;
  options.fix.correct_troposphere = options.troposphere = true;
  const Maps mean = solve(SharedReceiver{options, {}, {}, {}}, scene, wanted);
  int fixes = 0;
  for (std::size_t i = 0; i < 100; ++i) {
    if (std::isnan(still[0][i]) || std::isnan(mean[0][i])) continue;
    ++fixes;
    for (const Maps* maps : {&still, &mean}) {
      EXPECT_NEAR((*maps)[1][i], (*maps)[0][i], 1e-4F * (*maps)[0][i]);
      EXPECT_NEAR((*maps)[2][i], (*maps)[0][i], 1e-4F * (*maps)[0][i]);
      EXPECT_NEAR((*maps)[4][i], std::abs((*maps)[3][i]), 1e-4F * (*maps)[4][i]);
    }
  }
  EXPECT_GT(fixes, 50);
}

// A receiver at rest has the drifting mean in addition: sigma^2 = OU's + drift's.
TEST(SharedCells, DriftAddsToTheNoise) {
  TileScene scene(kGps, kHongKong);
  scene.lay({0, 0}, 2, 1, 1, 15);
  scene.compute_sky(quiet().fix.elevation_mask_rad);
  scene.receive(1, 0, 0, 12);
  const std::vector<Layer> wanted{Layer::HorizontalErrorRms, Layer::Hdop};
  ReceiverOptions options;
  options.noise.drift_enabled = true;
  const auto sigma = [&] {
    const Maps maps = solve(SharedReceiver{options, {10'000, 2}, {}, {}}, scene, wanted);
    return double{maps[0][0] / maps[1][0]};
  };
  EXPECT_NEAR(sigma(), std::sqrt(5.0), 0.03 * std::sqrt(5.0));
}

}  // namespace
}  // namespace canyon::heatmap
