#include "canyon/simulation/inertial/imu.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/options/values.hpp"

namespace canyon::inertial {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The rotation vector of a small rotation.
Vector3d rotation_vector_of(const Matrix3d& rotation) {
  // Half of the antisymmetric part is the axis times the sine of the angle.
  const Vector3d sine = 0.5 * Vector3d(rotation(2, 1) - rotation(1, 2), rotation(0, 2) - rotation(2, 0),
                                       rotation(1, 0) - rotation(0, 1));
  const double s = sine.norm();
  return s > 0 ? (std::asin(std::min(1.0, s)) / s) * sine : sine;
}

}  // namespace

IdealImu::IdealImu(const ImuOptions& options, BodyMotion motion, double step_s)
    : motion_(std::move(motion)), step_s_(step_s), position_m_(options.position_m) {
  body_from_sensor_ = body_from_sensor(options.orientation, options.axes);
}

const BodyState& IdealImu::body(std::int64_t index) {
  // Indices begin at -2.
  auto& kept = bodies_.at(static_cast<std::size_t>((index + kKept) % kKept));
  if (!kept || kept->first != index)
    kept = {index, motion_(std::round(static_cast<double>(index) * step_s_ * 1e9) / 1e9)};
  return kept->second;
}

const Vector3d& IdealImu::rotation_vector(std::int64_t index) {
  auto& kept = rotations_.at(static_cast<std::size_t>((index + kKept) % kKept));
  if (!kept || kept->first != index) {
    const Matrix3d& now = body(index).ecef_from_body;
    kept = {index, rotation_vector_of(now.transpose() * body(index + 1).ecef_from_body)};
  }
  return kept->second;
}

Vector3d IdealImu::gravity(const Vector3d& lever_arm_m) {
  Vector3d off = lever_arm_m - gravity_position_m_;
  if (off.squaredNorm() > 1) {
    gravity_position_m_ = lever_arm_m;
    gravity_mps2_ = geodesy::normal_gravity(lever_arm_m);
    // The gradient of a point mass: within 1 %, 3e-8 m/s^2 over a metre of height and 1e-8 along the ground.
    const Vector3d up = lever_arm_m.normalized();
    const double per_m = gravity_mps2_.norm() / lever_arm_m.norm();
    gravity_gradient_ = per_m * (3 * up * up.transpose() - Matrix3d::Identity());
    off.setZero();
  }
  return gravity_mps2_ + gravity_gradient_ * off;
}

ImuState IdealImu::at(std::int64_t index) {
  auto& kept = states_.at(static_cast<std::size_t>(index % kKept));
  if (kept && kept->first == index) return kept->second;
  const BodyState& body = this->body(index);
  const auto attitude = [this, index](std::int64_t off) -> const Matrix3d& {
    return this->body(index + off).ecef_from_body;
  };
  // Rotations from the current attitude, in the body's axes; those to neighbours are along their own axes.
  const auto far = [&](std::int64_t off) {
    return rotation_vector_of(body.ecef_from_body.transpose() * attitude(off));
  };
  const Vector3d rate =
      (far(-2) + 8 * rotation_vector(index - 1) + 8 * rotation_vector(index) - far(2)) / (12 * step_s_);

  ImuState state;
  state.sensor.ecef_from_body = body.ecef_from_body * body_from_sensor_;
  // The lever arm from the vehicle's point, and its derivatives.
  const Vector3d arm = body.ecef_from_body * position_m_;
  state.sensor.position_m = body.position_m + arm;
  state.sensor.velocity_mps = body.velocity_mps + body.ecef_from_body * rate.cross(position_m_);
  Vector3d second = Vector3d::Zero();
  if (!position_m_.isZero(0)) {
    const auto moved = [&](std::int64_t off) -> Vector3d { return attitude(off) * position_m_ - arm; };
    second = (-moved(-2) + 16 * moved(-1) + 16 * moved(1) - moved(2)) / (12 * step_s_ * step_s_);
  }
  state.sensor.acceleration_mps2 = body.acceleration_mps2 + second;

  const Vector3d earth(0, 0, geodesy::kEarthRotationRate);
  const Vector3d force = state.sensor.acceleration_mps2 + 2 * earth.cross(state.sensor.velocity_mps) -
                         gravity(state.sensor.position_m);
  const Matrix3d sensor_from_ecef = state.sensor.ecef_from_body.transpose();
  state.input.specific_force_mps2 = sensor_from_ecef * force;
  state.input.angular_rate_radps = sensor_from_ecef * earth + body_from_sensor_.transpose() * rate;
  kept = {index, state};
  return state;
}

ImuInput IdealImu::mean(std::int64_t from, std::int64_t to) {
  ImuInput sum;  // over 3 / step_s_
  const Vector3d earth(0, 0, geodesy::kEarthRotationRate);
  for (std::int64_t i = from; i <= to; ++i) {
    const double weight = i == from || i == to ? 1 : (i - from) % 2 == 1 ? 4 : 2;
    const ImuState state = at(i);
    sum.specific_force_mps2 += weight * state.input.specific_force_mps2;
    sum.angular_rate_radps += weight * (state.sensor.ecef_from_body.transpose() * earth);
  }
  // Rotations between attitudes of the body, minus the effect of a moving axis (coning).
  Vector3d rotated = Vector3d::Zero(), before = rotation_vector(from - 1), now = rotation_vector(from);
  for (std::int64_t i = from; i < to; ++i) {
    const Vector3d after = rotation_vector(i + 1);
    rotated += now - now.cross(after - before) / 24;
    before = now;
    now = after;
  }
  const auto steps = static_cast<double>(to - from);
  return {sum.specific_force_mps2 / (3 * steps),
          sum.angular_rate_radps / (3 * steps) + body_from_sensor_.transpose() * rotated / (steps * step_s_)};
}

namespace {

using geodesy::kPi;

/// A complex number whose square has the mean 1, with normal parts.
std::complex<double> complex_normal(RandomStream& random) {
  const double real = random.normal();
  return std::sqrt(0.5) * std::complex<double>(real, random.normal());
}

}  // namespace

Vibrations::Vibrations(const std::vector<VibrationOptions>& lines, RandomStream& random) {
  for (const VibrationOptions& options : lines) {
    // The spectrum of a correlation exp(-d t) has half its height at d / (2 pi) from its middle.
    Line& line = lines_.emplace_back(Line{options.frequency_hz,
                                          kPi * options.bandwidth_hz,
                                          {options.acceleration_mps2, geodesy::radians(options.rate_deg_s)},
                                          {}});
    for (std::complex<double>& phasor : line.phasors)
      phasor = line.decay_per_s > 0 ? complex_normal(random) : std::polar(1.0, 2 * kPi * random.uniform());
  }
}

ImuInput Vibrations::mean(double time_s, double dt_s, RandomStream& random) {
  ImuInput sum;
  for (Line& line : lines_) {
    const double half_rotation = kPi * line.frequency_hz * dt_s;
    const std::complex<double> middle = std::polar(std::sin(half_rotation) / half_rotation,
                                                   2 * kPi * line.frequency_hz * (time_s - dt_s / 2));
    const double keep = std::exp(-line.decay_per_s * dt_s), drive = std::sqrt(1 - keep * keep);
    for (std::size_t i = 0; i < line.phasors.size(); ++i) {
      std::complex<double>& phasor = line.phasors[i];
      if (line.decay_per_s > 0) phasor = keep * phasor + drive * complex_normal(random);
      Eigen::Vector3d& kind = i < 3 ? sum.specific_force_mps2 : sum.angular_rate_radps;
      kind[static_cast<Eigen::Index>(i % 3)] += line.amplitude.at(i / 3) * (phasor * middle).real();
    }
  }
  return sum;
}

namespace {

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
  // Steps may differ in their last digits.
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
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index k = 0; k < 3; ++k)
      matrix_(i, k) += (i == k ? numbers.scale : numbers.misalignment) * random.normal();
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
  options::check(options, "imu");
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
  const std::vector<SensorFault>& frozen = options_.frozen;
  if (std::any_of(frozen.begin(), frozen.end(), [&](const SensorFault& each) { return each.holds(time_s); }))
    sample.measured = last_;
  last_ = sample.measured;
  sample.time_s = time_s + options_.time_offset_s;
  if (options_.time_jitter_s > 0) sample.time_s += options_.time_jitter_s * random_.normal();
  if (options_.lost > 0 && random_.uniform() < options_.lost) return std::nullopt;
  return sample;
}

}  // namespace canyon::inertial
