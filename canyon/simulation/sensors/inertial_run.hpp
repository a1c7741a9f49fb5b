#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "canyon/inertial/ideal_imu.hpp"
#include "canyon/inertial/imu.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/sensors/sample_times.hpp"

namespace canyon::simulation {

/// A vehicle's pose as the motion of a rigid body.
[[nodiscard]] inertial::BodyState body_state(const Pose& pose);
/// A vehicle along a trajectory. `trajectory` must outlive it.
[[nodiscard]] std::function<inertial::BodyState(geodesy::GpsTime)> body_along(const Trajectory& trajectory);

/// Place, velocity and attitude of a sensor as people state them.
struct SensorMotion {
  SensorMotion(const inertial::BodyState& sensor, inertial::ImuAxes axes);

  Eigen::Vector3d place_deg_m;  ///< latitude, longitude [deg], height above the ellipsoid [m]
  Eigen::Vector3d velocity_enu_mps;
  Eigen::Vector3d attitude_deg;  ///< roll (left side up), pitch (nose up), heading from north, clockwise
};

/// A sample of an inertial sensor, and what is true at its instant.
struct InertialSample {
  geodesy::GpsTime time;                      ///< end of the sample's interval
  geodesy::GpsTime stated;                    ///< the same as the sensor states it, where it is not lost
  inertial::ImuState truth;                   ///< place, motion and input of the sensor at `time`
  inertial::ImuInput mean;                    ///< true means over the interval
  std::optional<inertial::ImuSample> sample;  ///< time_s counts from the run's begin; empty: lost
};

/// The samples of a vehicle's inertial sensor, in order. The same seed gives the same errors.
class InertialRun {
 public:
  /// @param vehicle its motion at any instant of the run and 5 ms around it; its acceleration is
  /// continuous. `begin`: the first sample ends one interval later.
  InertialRun(const inertial::ImuOptions& options, std::uint64_t seed, geodesy::GpsTime begin,
              const std::function<inertial::BodyState(geodesy::GpsTime)>& vehicle);

  /// The next sample, if its interval has ended at `until`.
  [[nodiscard]] std::optional<InertialSample> next(geodesy::GpsTime until);
  /// Leaves out the samples whose intervals end until `time`.
  void skip(geodesy::GpsTime time) { times_.skip(time); }

 private:
  SampleTimes times_;
  std::int64_t steps_;  // of ideal_, for each sample
  inertial::IdealImu ideal_;
  inertial::Imu imu_;
};

}  // namespace canyon::simulation
