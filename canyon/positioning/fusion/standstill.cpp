#include "canyon/positioning/fusion/standstill.hpp"

#include <algorithm>
#include <cmath>

namespace canyon::positioning {

using Eigen::Vector3d;

Standstill::Standstill(const SensorMounting& mounting)
    : window_(static_cast<std::size_t>(std::max(2.0, std::round(1 / mounting.imu_interval_s)))),
      has_wheels_(mounting.wheels.has_value()) {
  // Three times the noise of a sample, and what a motor shakes at least.
  const double per_sample = 3 / std::sqrt(mounting.imu_interval_s);
  force_limit_ = std::max(0.03, per_sample * mounting.accelerometer.white);
  rate_limit_ = std::max(0.003, per_sample * mounting.gyroscope.white);
}

void Standstill::add(const ImuReading& reading) {
  const auto count = [this](const ImuReading& r, double sign) {
    force_ += sign * r.specific_force_mps2;
    rate_ += sign * r.angular_rate_radps;
    force2_ += sign * r.specific_force_mps2.cwiseAbs2();
    rate2_ += sign * r.angular_rate_radps.cwiseAbs2();
  };
  readings_.push_back(reading);
  count(reading, 1);
  if (readings_.size() <= window_) return;
  count(readings_.front(), -1);
  readings_.pop_front();
}

void Standstill::add(const WheelReading& reading) {
  last_wheel_ = reading.time;
  if (reading.speed_mps != 0) {
    wheels_stand_since_.reset();
  } else if (!wheels_stand_since_) {
    wheels_stand_since_ = reading.time + -reading.dt_s;
  }
}

ImuReading Standstill::mean() const {
  const auto count = static_cast<double>(readings_.size());
  return {readings_.back().time, force_ / count, rate_ / count};
}

bool Standstill::quiet() const {
  if (!full()) return false;
  const auto count = static_cast<double>(readings_.size());
  const auto deviation = [count](const Vector3d& sum, const Vector3d& squares) {
    return std::sqrt(std::max(0.0, (squares / count - (sum / count).cwiseAbs2()).maxCoeff()));
  };
  return deviation(force_, force2_) < force_limit_ && deviation(rate_, rate2_) < rate_limit_;
}

bool Standstill::standing(std::optional<double> speed_mps) const {
  constexpr double kWheels_s = 0.5, kSlow_mps = 0.5;
  if (has_wheels_) {
    return wheels_stand_since_ && *last_wheel_ - *wheels_stand_since_ > kWheels_s - 1e-6 && quiet();
  }
  return speed_mps && *speed_mps < kSlow_mps && quiet();
}

}  // namespace canyon::positioning
