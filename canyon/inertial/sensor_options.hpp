#pragma once

#include <optional>

#include "canyon/inertial/barometer_options.hpp"
#include "canyon/inertial/imu_options.hpp"
#include "canyon/inertial/magnetometer_options.hpp"
#include "canyon/options/fwd.hpp"

namespace canyon::inertial {

/// Sensors of the two wheels of an axle that does not steer, whose middle is the trajectory's point.
struct WheelOptions {
  double rate_hz = 10;     ///< samples, [1, 1000]
  double track_m = 1.5;    ///< between the wheels, [0, 10]
  double tick_m = 0.02;    ///< way of one tick, [0, 10]; 0: speeds are not rounded, and there are no ticks
  double scale = 0.005;    ///< standard deviation of each wheel's relative error of the run, [0, 0.2]
  double slip = 0.003;     ///< standard deviation of each wheel's relative slip, [0, 0.5]
  double slip_time_s = 1;  ///< time constant of the slip, [0.01, 1000]
  bool direction = true;   ///< the sensors tell forwards from backwards
  double minimum_mps = 0;  ///< slower wheels are not sensed, [0, 10]

  void validate() const;
};

void visit(options::Visitor& v, WheelOptions& o);

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
