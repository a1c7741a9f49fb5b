#pragma once

#include <optional>

#include "canyon/inertial/barometer_options.hpp"
#include "canyon/inertial/imu_options.hpp"
#include "canyon/inertial/magnetometer_options.hpp"
#include "canyon/inertial/wheel_options.hpp"

namespace canyon::inertial {

/// Sensors of the vehicle beside its receivers.
struct SensorOptions {
  std::optional<ImuOptions> imu;
  std::optional<WheelOptions> wheels;
  std::optional<BarometerOptions> barometer;
  std::optional<MagnetometerOptions> magnetometer;

  [[nodiscard]] bool any() const { return feel_motion() || barometer || magnetometer; }
  /// Their motion must be smooth.
  [[nodiscard]] bool feel_motion() const { return imu || wheels; }
};

void visit(options::Visitor& v, SensorOptions& o);

}  // namespace canyon::inertial
