#include "canyon/inertial/imu.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "canyon/inertial/imu_options.hpp"

namespace canyon::inertial {
namespace {

using Eigen::Vector3d;

// The sum of the Allan variances of the processes (IEEE Std 952-1997, C.1.6) with deviation 1, between 6 and
// 5,000 s: within 4 % of this.
constexpr double kAllanOfLadder = 0.597;

}  // namespace

Vector3d three_normals(RandomStream& random) {
  const double x = random.normal(), y = random.normal();
  return {x, y, random.normal()};
}

FlickerNoise::FlickerNoise(double floor, RandomStream& random) : sigma_(floor / std::sqrt(kAllanOfLadder)) {
  for (Vector3d& value : values_)
    value = sigma_ > 0 ? Vector3d(sigma_ * three_normals(random)) : Vector3d::Zero();
}

Vector3d FlickerNoise::next(double dt_s, RandomStream& random) {
  Vector3d sum = Vector3d::Zero();
  if (!(sigma_ > 0)) return sum;
  // Steps differ in their last digits.
  if (std::abs(dt_s - dt_s_) > 1e-9 * dt_s) {
    dt_s_ = dt_s;
    double time_constant_s = 1;
    for (std::size_t i = 0; i < kProcesses; ++i) {
      every_[i] = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(time_constant_s / (500 * dt_s)));
      keep_[i] = std::exp(-static_cast<double>(every_[i]) * dt_s / time_constant_s);
      drive_[i] = sigma_ * std::sqrt(1 - keep_[i] * keep_[i]);
      time_constant_s *= 10;
    }
  }
  for (std::size_t i = 0; i < kProcesses; ++i) {
    if (samples_ % every_[i] == 0) values_[i] = keep_[i] * values_[i] + drive_[i] * three_normals(random);
    sum += values_[i];
  }
  ++samples_;
  return sum;
}

Triad::Triad(const TriadNumbers& numbers, RandomStream& random)
    : numbers_(numbers),
      matrix_(Eigen::Matrix3d::Identity()),
      bias_(numbers.turn_on * three_normals(random)),
      per_force_(numbers.per_force * three_normals(random)),
      flicker_(numbers.flicker, random) {
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index k = 0; k < 3; ++k)
      matrix_(i, k) += (i == k ? numbers.scale : numbers.misalignment) * random.normal();
  }
}

Vector3d Triad::measure(const Vector3d& mean, const Vector3d& force, double dt_s, RandomStream& random,
                        const Vector3d& more) {
  Vector3d value =
      matrix_ * mean + bias_ + more + per_force_.cwiseProduct(force) + flicker_.next(dt_s, random);
  if (numbers_.white > 0) value += numbers_.white / std::sqrt(dt_s) * three_normals(random);
  if (numbers_.walk > 0) bias_ += numbers_.walk * std::sqrt(dt_s) * three_normals(random);
  if (numbers_.resolution > 0)
    value = (value / numbers_.resolution).array().round().matrix() * numbers_.resolution;
  return value.cwiseMax(-numbers_.range).cwiseMin(numbers_.range);
}

Imu::Imu(const ImuOptions& options, std::uint64_t seed, std::string_view name)
    : options_(options),
      random_(seed, "imu/" + std::string(name)),
      gyroscope_(imu_numbers(options).gyroscope, random_),
      accelerometer_(imu_numbers(options).accelerometer, random_),
      surroundings_(seed, "imu/" + std::string(name) + "/surroundings"),
      per_kelvin_{imu_numbers(options).accelerometer.per_kelvin * three_normals(surroundings_),
                  imu_numbers(options).gyroscope.per_kelvin * three_normals(surroundings_)},
      scale_per_kelvin_{imu_numbers(options).accelerometer.scale_per_kelvin * three_normals(surroundings_),
                        imu_numbers(options).gyroscope.scale_per_kelvin * three_normals(surroundings_)},
      vibrations_(options.vibration, surroundings_) {
  options.validate();
}

std::optional<ImuSample> Imu::measure(const ImuInput& mean, double time_s, double dt_s) {
  ImuSample sample;
  const ImuTemperatureOptions& temperature = options_.temperature;
  sample.temperature_k = kZeroCelsius_k + temperature.air_c +
                         warming_k(temperature.warming_k, temperature.warming_time_s, time_s);
  const double warmer_k = sample.temperature_k - kCalibrated_k;
  const ImuInput shaking = vibrations_.mean(time_s, dt_s, surroundings_);
  const Vector3d force = mean.specific_force_mps2 + shaking.specific_force_mps2;
  const Vector3d rate = mean.angular_rate_radps + shaking.angular_rate_radps;
  sample.measured.angular_rate_radps = gyroscope_.measure(
      rate, force, dt_s, random_,
      warmer_k * (per_kelvin_.angular_rate_radps + scale_per_kelvin_.angular_rate_radps.cwiseProduct(rate)));
  sample.measured.specific_force_mps2 =
      accelerometer_.measure(force, force, dt_s, random_,
                             warmer_k * (per_kelvin_.specific_force_mps2 +
                                         scale_per_kelvin_.specific_force_mps2.cwiseProduct(force)));
  sample.time_s = time_s + options_.time_offset_s;
  if (options_.time_jitter_s > 0) sample.time_s += options_.time_jitter_s * random_.normal();
  if (options_.lost > 0 && random_.uniform() < options_.lost) return std::nullopt;
  return sample;
}

}  // namespace canyon::inertial
