#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>

#include "canyon/positioning/fusion/sensor_readings.hpp"

namespace canyon::positioning {

/// Whether a vehicle stands, by its sensors: its wheels gave no tick for half a second; without wheels its
/// inertial sensor felt no change over a second, and it is known to be slow.
class Standstill {
 public:
  explicit Standstill(const SensorMounting& mounting);

  void add(const ImuReading& reading);
  void add(const WheelReading& reading);
  /// @param speed_mps as far as it is known; empty: it is not
  [[nodiscard]] bool standing(std::optional<double> speed_mps) const;
  /// Means over the last second.
  [[nodiscard]] ImuReading mean() const;
  /// A second of readings has come.
  [[nodiscard]] bool full() const { return readings_.size() >= window_; }

 private:
  [[nodiscard]] bool quiet() const;

  double force_limit_, rate_limit_;  // standard deviations of a sensor at rest
  std::size_t window_;
  bool has_wheels_;
  std::deque<ImuReading> readings_;
  Eigen::Vector3d force_ = Eigen::Vector3d::Zero(), rate_ = Eigen::Vector3d::Zero();    // sums
  Eigen::Vector3d force2_ = Eigen::Vector3d::Zero(), rate2_ = Eigen::Vector3d::Zero();  // of squares
  std::optional<geodesy::GpsTime> wheels_stand_since_, last_wheel_;
};

}  // namespace canyon::positioning
