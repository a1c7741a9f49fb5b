#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/outputs/encoding/ubx/messages.hpp"

namespace canyon::encoding::ubx {
namespace {

using positioning::Fusion;
using positioning::FusionPhase;

// Types of sensors (UBX-13003221, external sensor fusion).
constexpr std::uint8_t kGyroscopeZ = 5, kGyroscopeY = 13, kGyroscopeX = 14;
constexpr std::uint8_t kRearLeftTicks = 8, kRearRightTicks = 9;
constexpr std::uint8_t kAccelerometerX = 16, kAccelerometerY = 17, kAccelerometerZ = 18;

constexpr std::uint8_t kInitialising = 1, kInitialised = 2;

/// A sensor: its type, used and ready; calibration and times of its samples; rate; faults.
void put_sensor(Payload& p, std::uint8_t type, bool used, bool calibrated, double rate_hz) {
  constexpr std::uint8_t kUsed = 1 << 6, kReady = 1 << 7, kTimedByReceiver = 1 << 2;
  const std::uint8_t calibration = !used ? 0 : calibrated ? 2 : 1;
  p.u1(type | (used ? kUsed : 0) | kReady).u1(calibration | kTimedByReceiver);
  p.u1(static_cast<std::uint8_t>(std::clamp(std::round(rate_hz), 0.0, 255.0))).u1(0);
}

/// A measurement: 24 bits of data, the type above them.
std::uint32_t measurement(std::uint8_t type, std::int64_t data) {
  return static_cast<std::uint32_t>(data & 0xFFFFFF) | static_cast<std::uint32_t>(type) << 24;
}
std::int64_t in_24_bits(double value, double step) {
  constexpr double kMax = (1 << 23) - 1;
  return std::llround(std::clamp(value / step, -kMax, kMax));
}

/// The header of ESF-MEAS: time tag, number of measurements in bits 15 to 11, provider.
Payload samples_head(std::uint32_t time_ms, int count) {
  Payload p;
  p.u4(time_ms).u2(count << 11).u2(0);
  return p;
}

/// Gyroscopes and accelerometers: rates in 2^-12 deg/s, accelerations in 2^-10 m/s^2 (UBX-13003221).
std::array<std::uint32_t, 6> inertial_measurements(const Eigen::Vector3d& specific_force_mps2,
                                                   const Eigen::Vector3d& angular_rate_radps) {
  constexpr double kRate = 1.0 / 4096, kAcceleration = 1.0 / 1024;
  constexpr std::array kGyroscopes{kGyroscopeX, kGyroscopeY, kGyroscopeZ};
  constexpr std::array kAccelerometers{kAccelerometerX, kAccelerometerY, kAccelerometerZ};
  std::array<std::uint32_t, 6> result{};
  for (Eigen::Index i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    result[k] = measurement(kGyroscopes[k], in_24_bits(geodesy::degrees(angular_rate_radps[i]), kRate));
    result[k + 3] = measurement(kAccelerometers[k], in_24_bits(specific_force_mps2[i], kAcceleration));
  }
  return result;
}

}  // namespace

std::string inertial_payload(std::uint32_t time_ms, const Eigen::Vector3d& specific_force_mps2,
                             const Eigen::Vector3d& angular_rate_radps) {
  Payload p = samples_head(time_ms, 6);
  for (const std::uint32_t value : inertial_measurements(specific_force_mps2, angular_rate_radps))
    p.u4(value);
  return p.bytes();
}

std::string raw_inertial_payload(std::span<const RawInertialSample> samples) {
  Payload p;
  p.zeros(4);
  for (const RawInertialSample& sample : samples)
    for (const std::uint32_t value :
         inertial_measurements(sample.specific_force_mps2, sample.angular_rate_radps))
      p.u4(value).u4(sample.time_ms);
  return p.bytes();
}

// Ticks in 23 bits, the direction above them.
std::string wheels_payload(std::uint32_t time_ms, const std::array<std::uint32_t, 2>& ticks,
                           const std::array<bool, 2>& backwards) {
  Payload p = samples_head(time_ms, 2);
  constexpr std::array kWheels{kRearLeftTicks, kRearRightTicks};
  for (std::size_t i = 0; i < kWheels.size(); ++i)
    p.u4(measurement(kWheels[i], (ticks[i] & 0x7FFFFFU) | (backwards[i] ? 0x800000U : 0U)));
  return p.bytes();
}

// ESF-STATUS, version 2 (UBX-13003221).
std::string esf_status(const UbxEpoch& epoch) {
  const auto& known = epoch.seen.fix.fusion;
  constexpr std::uint8_t kDisabled = 3;
  Payload p;
  p.u4(itow(epoch)).u1(2);
  if (!known) return p.zeros(7).u1(kDisabled).zeros(2).u1(0).bytes();
  const Fusion& fusion = *known;
  const bool fused = fusion.phase != FusionPhase::Initialising;
  const std::uint8_t state = fused ? kInitialised : kInitialising;
  // Wheel ticks; the mounting of the sensor, which is known; position, velocity and attitude.
  const std::uint8_t wheels = fusion.wheels_hz > 0 ? state : 0;
  p.u1(wheels | kInitialised << 2 | state << 5).u1(state).zeros(5);
  p.u1(fused ? 1 : 0).zeros(2).u1(fusion.wheels_hz > 0 ? 8 : 6);
  for (const std::uint8_t type :
       {kGyroscopeZ, kGyroscopeY, kGyroscopeX, kAccelerometerX, kAccelerometerY, kAccelerometerZ})
    put_sensor(p, type, fused, fusion.imu_calibrated, fusion.imu_hz);
  if (fusion.wheels_hz > 0)
    for (const std::uint8_t type : {kRearLeftTicks, kRearRightTicks})
      put_sensor(p, type, fused, fusion.wheels_calibrated, fusion.wheels_hz);
  return p.bytes();
}

}  // namespace canyon::encoding::ubx
