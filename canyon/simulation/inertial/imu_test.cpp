#include "canyon/simulation/inertial/imu.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"

namespace canyon::inertial {
namespace {

using Eigen::Vector3d;

const geodesy::Geodetic kPosition = geodesy::Geodetic::from_degrees(22.3, 114.17, 50);

/// A turntable about the local vertical with its point at rest; level, forward to the east at 0 s.
BodyMotion turntable(double rate_radps) {
  return [rate_radps](double t) {
    const Eigen::Matrix3d ecef_from_enu = geodesy::enu_from_ecef_rotation(kPosition).transpose();
    return BodyState{geodesy::ecef_from_geodetic(kPosition), Vector3d::Zero(), Vector3d::Zero(),
                     ecef_from_enu * Eigen::AngleAxisd(rate_radps * t, Vector3d::UnitZ()).toRotationMatrix()};
  };
}

// A sensor at rest measures gravity upwards, and Earth's rotation towards the pole.
TEST(IdealImu, FeelsGravityAndTheEarthAtRest) {
  const ImuInput still = IdealImu({}, turntable(0), 0.0025).mean(0, 4);
  const double latitude = kPosition.latitude_rad, earth = geodesy::kEarthRotationRate;
  EXPECT_NEAR(still.angular_rate_radps.y(), earth * std::cos(latitude), 1e-9 * earth);
  EXPECT_NEAR(still.angular_rate_radps.z(), earth * std::sin(latitude), 1e-9 * earth);
  EXPECT_NEAR(still.angular_rate_radps.x(), 0, 1e-9 * earth);
  const double gravity = geodesy::normal_gravity(geodesy::ecef_from_geodetic(kPosition)).norm();
  EXPECT_NEAR(still.specific_force_mps2.z(), gravity, 1e-9 * gravity);
  EXPECT_NEAR(still.specific_force_mps2.head<2>().norm(), 0, 1e-6 * gravity);
}

// 2 m from the axis of a turntable: the centripetal acceleration, plus Earth's rotation.
TEST(IdealImu, FeelsItsArm) {
  ImuOptions options;
  options.position_m = {2, 0, 0};
  const double rate = 0.5;
  const ImuState state = IdealImu(options, turntable(rate), 0.002).at(0);
  const double earth_up = geodesy::kEarthRotationRate * std::sin(kPosition.latitude_rad);
  EXPECT_NEAR(state.input.angular_rate_radps.z(), rate + earth_up, 1e-11);
  // Towards the axis, with Coriolis: 2 (w x v) for a velocity of 1 m/s to the north; and gravity, whose
  // vertical differs 2 m away.
  EXPECT_NEAR(state.input.specific_force_mps2.x(),
              -rate * rate * 2 - 2 * earth_up * rate * 2 + 9.79 * 2 / 6.378e6, 1e-8);
  EXPECT_NEAR(state.input.specific_force_mps2.y(), 0, 1e-6);
  const Vector3d enu = geodesy::enu_from_ecef_rotation(kPosition) *
                       (state.sensor.position_m - geodesy::ecef_from_geodetic(kPosition));
  EXPECT_NEAR((enu - Vector3d(2, 0, 0)).norm(), 0, 1e-8);
}

// The sensor's axes: nose of the sensor to the vehicle's left, then forward, right, down.
TEST(IdealImu, TurnsIntoTheSensorsAxes) {
  ImuOptions options;
  options.orientation.yaw_deg = 90;
  ImuInput rotated = IdealImu(options, turntable(0), 0.002).at(0).input;
  const double earth_north = geodesy::kEarthRotationRate * std::cos(kPosition.latitude_rad);
  EXPECT_NEAR(rotated.angular_rate_radps.x(), earth_north, 1e-12);
  options.axes = ImuAxes::Frd;
  rotated = IdealImu(options, turntable(0), 0.002).at(0).input;
  EXPECT_NEAR(rotated.angular_rate_radps.x(), earth_north, 1e-12);
  EXPECT_LT(rotated.specific_force_mps2.z(), -9.7);
  // Nose up: gravity's reaction has a component along the nose.
  ImuOptions nose_up;
  nose_up.orientation.pitch_deg = 30;
  EXPECT_NEAR(IdealImu(nose_up, turntable(0), 0.002).at(0).input.specific_force_mps2.x(), 9.787 * 0.5, 0.01);
  ImuOptions left_up;
  left_up.orientation.roll_deg = 30;
  EXPECT_NEAR(IdealImu(left_up, turntable(0), 0.002).at(0).input.specific_force_mps2.y(), 9.787 * 0.5, 0.01);
}

/// Allan deviation of samples at averaging times of `m` samples each, without overlap (IEEE Std 952, C.1).
double allan(const std::vector<double>& samples, std::size_t m) {
  std::vector<double> means;
  for (std::size_t i = 0; i + m <= samples.size(); i += m) {
    double sum = 0;
    for (std::size_t k = 0; k < m; ++k) sum += samples[i + k];
    means.push_back(sum / static_cast<double>(m));
  }
  double sum = 0;
  for (std::size_t i = 0; i + 1 < means.size(); ++i) sum += std::pow(means[i + 1] - means[i], 2);
  return std::sqrt(sum / (2 * static_cast<double>(means.size() - 1)));
}

/// Three axes of a sensor at rest, concatenated: their differences remain far apart.
std::vector<std::vector<double>> at_rest(const TriadNumbers& numbers, double rate_hz, std::size_t count,
                                         std::uint64_t seed = 1) {
  RandomStream random(seed, "allan");
  Triad triad(numbers, random);
  std::vector<std::vector<double>> axes(3);
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3d value = triad.measure(Vector3d::Zero(), Vector3d::Zero(), 1 / rate_hz, random);
    for (Eigen::Index k = 0; k < 3; ++k) axes[static_cast<std::size_t>(k)].push_back(value[k]);
  }
  return axes;
}
double allan(const std::vector<std::vector<double>>& axes, std::size_t m) {
  double sum = 0;
  for (const std::vector<double>& axis : axes) sum += std::pow(allan(axis, m), 2);
  return std::sqrt(sum / static_cast<double>(axes.size()));
}

class ProfileAllan : public ::testing::TestWithParam<ImuProfile> {};

// White noise and bias instability of each profile are found in its samples within 10 %: a slope of -1/2 at 1
// s, and the lowest point of the curve.
TEST_P(ProfileAllan, IsThatOfItsNumbers) {
  ImuOptions options;
  options.profile = GetParam();
  const ImuNumbers numbers = imu_numbers(options);
  for (TriadNumbers triad : {numbers.gyroscope, numbers.accelerometer}) {
    triad.resolution = 0;
    // Without 1/f noise, which is strong at 1 s in some parts.
    TriadNumbers white = triad;
    white.flicker = 0;
    const auto fast = at_rest(white, 20, 200'000);
    EXPECT_NEAR(allan(fast, 20) / triad.white, 1, 0.05);
    EXPECT_NEAR(allan(fast, 2000) / allan(fast, 20), 0.1, 0.01);
    TriadNumbers flicker = triad;
    flicker.white = 0;
    double lowest = std::numeric_limits<double>::infinity();
    double sum = 0;
    constexpr std::size_t kRuns = 8;
    for (std::size_t m = 10; m <= 640; m *= 4) {
      for (std::uint64_t seed = 1; seed <= kRuns; ++seed)
        sum += std::pow(allan(at_rest(flicker, 1, 30'000, seed), m), 2);
      lowest = std::min(lowest, std::sqrt(std::exchange(sum, 0) / kRuns));
    }
    EXPECT_NEAR(lowest / triad.flicker, 1, 0.1);
  }
}
INSTANTIATE_TEST_SUITE_P(All, ProfileAllan,
                         ::testing::Values(ImuProfile::Consumer, ImuProfile::Automotive,
                                           ImuProfile::Tactical));

// The Allan deviation of a random walk rises with sqrt(t / 3).
TEST(Triad, BiasWalks) {
  TriadNumbers numbers;
  numbers.walk = 1e-3;
  numbers.range = std::numeric_limits<double>::infinity();
  const auto axes = at_rest(numbers, 1, 100'000);
  EXPECT_NEAR(allan(axes, 100) / (1e-3 * std::sqrt(100.0 / 3)), 1, 0.1);
}

TEST(Triad, RoundsAndCutsOff) {
  TriadNumbers numbers;
  numbers.resolution = 0.25;
  numbers.range = 2;
  RandomStream random(1, "triad");
  Triad triad(numbers, random);
  EXPECT_EQ(triad.measure({0.3, -5, 7}, Vector3d::Zero(), 1, random), Vector3d(0.25, -2, 2));
}

// Deviations of biases, scale, misalignment and g-sensitivity over many sensors.
TEST(Triad, DrawsItsErrors) {
  TriadNumbers numbers;
  numbers.turn_on = 0.1;
  numbers.scale = 0.01;
  numbers.misalignment = 0.02;
  numbers.per_force = 0.003;
  numbers.range = std::numeric_limits<double>::infinity();
  double bias = 0, scale = 0, across = 0, by_force = 0;
  constexpr int kSensors = 4000;
  for (int i = 0; i < kSensors; ++i) {
    RandomStream random(static_cast<std::uint64_t>(i), "sensor");
    Triad triad(numbers, random);
    const Vector3d zero = triad.measure(Vector3d::Zero(), Vector3d::Zero(), 1, random);
    const Vector3d along = triad.measure(Vector3d::UnitX(), Vector3d::Zero(), 1, random) - zero;
    const Vector3d forced = triad.measure(Vector3d::Zero(), Vector3d::UnitX(), 1, random) - zero;
    bias += zero.x() * zero.x();
    scale += std::pow(along.x() - 1, 2);
    across += along.y() * along.y();
    by_force += forced.x() * forced.x();
  }
  EXPECT_NEAR(std::sqrt(bias / kSensors), 0.1, 0.005);
  EXPECT_NEAR(std::sqrt(scale / kSensors), 0.01, 0.0005);
  EXPECT_NEAR(std::sqrt(across / kSensors), 0.02, 0.001);
  EXPECT_NEAR(std::sqrt(by_force / kSensors), 0.003, 0.00015);
}

// The same seed gives the same sensor; time stamps and losses are as configured.
TEST(Imu, StatesTimesAndLosesSamples) {
  ImuOptions options;
  options.profile = ImuProfile::Ideal;
  options.time_offset_s = 0.02;
  options.time_jitter_s = 1e-3;
  options.lost = 0.25;
  Imu imu(options, 3), same(options, 3);
  int lost = 0;
  double sum = 0, squares = 0;
  constexpr int kSamples = 20'000;
  const ImuInput input{{1, 2, 3}, {4, 5, 6}};
  for (int k = 1; k <= kSamples; ++k) {
    const auto sample = imu.measure(input, 0.01 * k, 0.01), again = same.measure(input, 0.01 * k, 0.01);
    ASSERT_EQ(sample.has_value(), again.has_value());
    if (!sample) {
      ++lost;
      continue;
    }
    EXPECT_EQ(sample->time_s, again->time_s);
    EXPECT_EQ(sample->measured.specific_force_mps2, input.specific_force_mps2);
    const double off = sample->time_s - 0.01 * k;
    sum += off;
    squares += off * off;
  }
  EXPECT_NEAR(lost / double{kSamples}, 0.25, 0.015);
  const double mean = sum / (kSamples - lost);
  EXPECT_NEAR(mean, 0.02, 1e-4);
  EXPECT_NEAR(std::sqrt(squares / (kSamples - lost) - mean * mean), 1e-3, 5e-5);
}

/// Samples of an ideal sensor at 0, with these surroundings.
std::vector<ImuSample> samples_of(const ImuOptions& options, int count, std::uint64_t seed = 1) {
  Imu imu(options, seed);
  std::vector<ImuSample> samples;
  for (int k = 1; k <= count; ++k)
    samples.push_back(imu.measure({}, k / options.rate_hz, 1 / options.rate_hz).value());
  return samples;
}

// The bias follows the warming: 63.2 % of it after one time constant, nothing at the start at 25 deg C.
TEST(Imu, FreezesAndGoesOn) {
  ImuOptions options;
  options.profile = ImuProfile::Ideal;
  options.frozen = {{0.025, 0.045}};
  Imu imu(options, 3);
  std::vector<double> reported;
  for (int k = 1; k <= 6; ++k) {
    const auto sample = imu.measure({{1.0 * k, 0, 0}, {0, 0, 0}}, 0.01 * k, 0.01);
    ASSERT_TRUE(sample);
    EXPECT_DOUBLE_EQ(sample->time_s, 0.01 * k);
    reported.push_back(sample->measured.specific_force_mps2.x());
  }
  EXPECT_EQ(reported, (std::vector<double>{1, 2, 2, 2, 5, 6}));
}

TEST(Imu, BiasFollowsTheTemperature) {
  ImuOptions options;
  options.profile = ImuProfile::Ideal;
  options.rate_hz = 1;
  options.gyroscope.temperature_deg_h_k = 18;
  options.accelerometer.temperature_mg_k = 0.15;
  options.temperature = {25, 20, 100};
  const auto samples = samples_of(options, 2000);
  EXPECT_NEAR(samples.back().temperature_k, 273.15 + 45, 1e-6);
  EXPECT_NEAR(samples[99].temperature_k, 273.15 + 25 + 20 * (1 - std::exp(-1.0)), 1e-9);
  const Vector3d last = samples.back().measured.angular_rate_radps;
  EXPECT_GT(last.norm(), 0);
  EXPECT_NEAR((samples[99].measured.angular_rate_radps - (1 - std::exp(-1.0)) * last).norm(), 0,
              1e-6 * last.norm());
  EXPECT_LT(samples[0].measured.specific_force_mps2.norm(),
            0.011 * samples.back().measured.specific_force_mps2.norm());
  // Over many sensors the deviations per K are those of the options; in the cold from the start.
  options.temperature = {-5, 0, 100};
  double rates = 0, forces = 0;
  constexpr int kSensors = 3000;
  for (std::uint64_t seed = 1; seed <= kSensors; ++seed) {
    const ImuInput measured = samples_of(options, 1, seed)[0].measured;
    rates += measured.angular_rate_radps.squaredNorm();
    forces += measured.specific_force_mps2.squaredNorm();
  }
  EXPECT_NEAR(geodesy::degrees(std::sqrt(rates / (3 * kSensors))) * 3600 / (30 * 18), 1, 0.03);
  EXPECT_NEAR(std::sqrt(forces / (3 * kSensors)) / (30 * 0.15e-3 * kStandardGravity), 1, 0.03);
}

TEST(Imu, ScaleFactorFollowsTheTemperature) {
  ImuOptions options;
  options.profile = ImuProfile::Ideal;
  options.gyroscope.scale_temperature_ppm_k = 50;
  options.accelerometer.scale_temperature_ppm_k = 20;
  options.temperature = {-5, 0, 100};  // 30 K below
  const ImuInput input{{1, -2, 9.8}, {0.5, 0.1, -1}};
  double rates = 0, forces = 0;
  constexpr int kSensors = 3000;
  for (std::uint64_t seed = 1; seed <= kSensors; ++seed) {
    const ImuInput measured = Imu(options, seed).measure(input, 1, 0.01).value().measured;
    rates += (measured.angular_rate_radps.cwiseQuotient(input.angular_rate_radps) - Vector3d::Ones())
                 .squaredNorm();
    forces += (measured.specific_force_mps2.cwiseQuotient(input.specific_force_mps2) - Vector3d::Ones())
                  .squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(rates / (3 * kSensors)) / (30 * 50e-6), 1, 0.03);
  EXPECT_NEAR(std::sqrt(forces / (3 * kSensors)) / (30 * 20e-6), 1, 0.03);
  options.temperature = {25, 0, 100};
  EXPECT_NEAR(
      (Imu(options, 1).measure(input, 1, 0.01).value().measured.angular_rate_radps - input.angular_rate_radps)
          .norm(),
      0, 1e-15);
}

/// Amplitude of the line at `frequency_hz` in the samples' x axis of specific force.
double line_at(const std::vector<ImuSample>& samples, double frequency_hz, double rate_hz) {
  std::complex<double> sum = 0;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    sum += samples[k].measured.specific_force_mps2.x() *
           std::polar(1.0, -2 * geodesy::kPi * frequency_hz * static_cast<double>(k + 1) / rate_hz);
  }
  return 2 * std::abs(sum) / static_cast<double>(samples.size());
}

// Rotors at 230 Hz and a sensor at 100 Hz: the line is aliased to 30 Hz, weakened by the mean over a sample.
TEST(Imu, VibrationAliases) {
  ImuOptions options;
  options.profile = ImuProfile::Ideal;
  options.vibration = {{230, 0, 5, 10}};
  const auto samples = samples_of(options, 10'000);
  const double weakened = std::abs(std::sin(geodesy::kPi * 2.3) / (geodesy::kPi * 2.3));
  EXPECT_NEAR(line_at(samples, 30, 100), 5 * weakened, 0.01);
  EXPECT_LT(line_at(samples, 20, 100), 1e-3);
  double squares = 0;
  for (const ImuSample& sample : samples) squares += sample.measured.angular_rate_radps.squaredNorm();
  EXPECT_NEAR(std::sqrt(squares / 10'000 / 3 * 2), geodesy::radians(10) * weakened, 1e-3);
}

// A band of 2 Hz about 20 Hz: the power of the amplitude, and half of its height 1 Hz from the middle.
TEST(Imu, VibrationHasABand) {
  ImuOptions options;
  options.profile = ImuProfile::Ideal;
  options.vibration = {{20, 2, 5, 0}};
  constexpr int kSamples = 2000, kRuns = 300;
  double power = 0, middle = 0, side = 0;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    const auto samples = samples_of(options, kSamples, seed);
    for (const ImuSample& sample : samples) power += std::pow(sample.measured.specific_force_mps2.x(), 2);
    middle += std::pow(line_at(samples, 20, 100), 2);
    side += std::pow(line_at(samples, 21, 100), 2) / 2 + std::pow(line_at(samples, 19, 100), 2) / 2;
  }
  const double weakened = std::sin(geodesy::kPi * 0.2) / (geodesy::kPi * 0.2);
  EXPECT_NEAR(std::sqrt(2 * power / (kSamples * kRuns)) / (5 * weakened), 1, 0.03);
  EXPECT_NEAR(side / middle, 0.5, 0.08);
}

// The other errors of a sensor do not depend on its surroundings.
TEST(Imu, SurroundingsDrawTheirOwnNumbers) {
  ImuOptions options;
  options.profile = ImuProfile::Consumer;
  const auto calm = samples_of(options, 10);
  options.vibration = {{80, 1, 1, 1}};
  options.temperature = {25, 0, 10};
  options.gyroscope.resolution_deg_s = options.accelerometer.resolution_mg = 0;
  ImuOptions exact = options;
  exact.vibration.clear();
  const auto without = samples_of(exact, 10), with = samples_of(options, 10);
  ImuOptions ideal = options;
  ideal.profile = ImuProfile::Ideal;
  const auto alone = samples_of(ideal, 10);
  for (std::size_t k = 0; k < 10; ++k) {
    const Vector3d added = with[k].measured.specific_force_mps2 - without[k].measured.specific_force_mps2;
    EXPECT_NEAR((added - alone[k].measured.specific_force_mps2).norm(), 0, 0.05);  // its scale, its axes
    EXPECT_EQ(with[k].time_s, calm[k].time_s);
  }
}

}  // namespace
}  // namespace canyon::inertial
