#include "canyon/simulation/inertial/sensors.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "canyon/base/input_error.hpp"

namespace canyon::inertial {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kMicro = 1e-6;
const Vector3d kField = kMicro * Vector3d(1, 30, -40);

MagnetometerOptions perfect_magnetometer() {
  MagnetometerOptions options;
  options.profile = MagnetometerProfile::Ideal;
  return options;
}

TEST(Magnetometer, WithoutErrorsStatesTheFieldInItsAxes) {
  Matrix3d enu_from_sensor;  // its nose is to the north, in axes forward, left, up
  enu_from_sensor << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const Vector3d value = Magnetometer(perfect_magnetometer(), 1).measure(kField, enu_from_sensor, 1);
  EXPECT_NEAR((value - kMicro * Vector3d(30, -1, -40)).norm(), 0, 1e-18);
}

TEST(Magnetometer, IsRoundedAndCutOff) {
  MagnetometerOptions options = perfect_magnetometer();
  options.resolution_ut = 0.3;
  options.range_ut = 35;
  const Vector3d value = Magnetometer(options, 1).measure(kField, Matrix3d::Identity(), 1);
  EXPECT_NEAR(value.x(), 0.9 * kMicro, 1e-18);
  EXPECT_NEAR(value.z(), -35 * kMicro, 1e-18);
}

// Noise within a run; hard and soft iron from run to run.
TEST(Magnetometer, HasTheErrorsOfItsNumbers) {
  MagnetometerOptions noisy = perfect_magnetometer();
  noisy.noise_ut = 0.3;
  Magnetometer one(noisy, 5);
  constexpr int kSamples = 4000;
  double noise2 = 0;
  for (int i = 0; i < kSamples; ++i)
    noise2 += (one.measure(kField, Matrix3d::Identity(), 0) - kField).squaredNorm() / 3;
  EXPECT_NEAR(std::sqrt(noise2 / kSamples) / (0.3 * kMicro), 1, 0.03);

  MagnetometerOptions iron = perfect_magnetometer();
  iron.hard_iron_ut = 10;
  iron.soft_iron = 0.05;
  double hard2 = 0, soft2 = 0;
  constexpr int kRuns = 2000;
  for (int run = 0; run < kRuns; ++run) {
    Magnetometer sensor(iron, static_cast<std::uint64_t>(run));
    const Vector3d still = sensor.measure(Vector3d::Zero(), Matrix3d::Identity(), 0);
    hard2 += still.squaredNorm() / 3;
    soft2 += (sensor.measure(kField, Matrix3d::Identity(), 0) - still - kField).squaredNorm() / 3;
  }
  EXPECT_NEAR(hard2 / kRuns / std::pow(10 * kMicro, 2), 1, 0.08);
  EXPECT_NEAR(soft2 / kRuns / std::pow(0.05 * kField.norm(), 2), 1, 0.08);
}

// The field of steel changes with distance, not with time.
TEST(Magnetometer, FeelsWhatStandsByTheWay) {
  MagnetometerOptions options = perfect_magnetometer();
  options.surroundings_ut = 5;
  double size2 = 0, product = 0;
  constexpr int kRuns = 2000;
  for (int run = 0; run < kRuns; ++run) {
    Magnetometer sensor(options, static_cast<std::uint64_t>(run));
    const auto error = [&](double travelled_m) -> Vector3d {
      return sensor.measure(kField, Matrix3d::Identity(), travelled_m) - kField;
    };
    const Vector3d first = error(1);
    EXPECT_EQ(error(0), first);
    size2 += first.squaredNorm() / 3;
    product += first.dot(error(10)) / 3;
  }
  const double wanted2 = std::pow(5 * kMicro, 2);
  EXPECT_NEAR(size2 / kRuns / wanted2, 1, 0.08);
  EXPECT_NEAR(product / kRuns / wanted2, std::exp(-1), 0.06);
}

TEST(Magnetometer, RefusesNumbersOutOfRange) {
  MagnetometerOptions options;
  options.range_ut = 0;
  EXPECT_THROW(Magnetometer(options, 1), InputError);
}

}  // namespace
}  // namespace canyon::inertial
