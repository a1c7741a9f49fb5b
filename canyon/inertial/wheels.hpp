#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "canyon/base/random.hpp"
#include "canyon/inertial/sensor_options.hpp"

namespace canyon::inertial {

/// Values of the left and the right wheel.
using WheelPair = std::array<double, 2>;

/// The wheels at the end of an interval.
struct WheelSample {
  WheelPair speed_mps{};  ///< means of the interval; never below 0 without direction
  std::optional<std::array<std::int64_t, 2>> ticks;  ///< counted since the start; empty: not rounded
};

/// Sensors of two wheels: way (1 + scale + slip), counted in ticks. The same seed gives the same errors.
class Wheels {
 public:
  Wheels(const WheelOptions& options, std::uint64_t seed);
  /// The next sample. @param way_m that the wheels' points moved forwards in `dt_s`, above 0
  [[nodiscard]] WheelSample measure(const WheelPair& way_m, double dt_s);

 private:
  struct Wheel {
    double scale = 0, slip = 0;
    double counted_m = 0;  ///< that the sensor has felt
    double stated_m = 0;   ///< of it, in whole ticks
  };
  WheelOptions options_;
  RandomStream random_;
  std::array<Wheel, 2> wheels_;
};

}  // namespace canyon::inertial
