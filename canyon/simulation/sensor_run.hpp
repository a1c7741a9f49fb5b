#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/simulation/inertial/imu.hpp"
#include "canyon/simulation/inertial/sensor_options.hpp"
#include "canyon/simulation/inertial/sensors.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::simulation {

/// The intervals of a sensor's samples, one after another, from the start of a run.
class SampleTimes {
 public:
  /// Seconds since the start of the run, rounded to whole nanoseconds like all instants.
  struct Interval {
    double from_s = 0, to_s = 0;
  };
  /// @param rate_hz > 0
  SampleTimes(geodesy::GpsTime begin, double rate_hz) : begin_(begin), rate_hz_(rate_hz) {}

  [[nodiscard]] geodesy::GpsTime begin() const { return begin_; }
  /// Number of intervals passed by pass() or skip().
  [[nodiscard]] std::int64_t count() const { return count_; }
  [[nodiscard]] double end_s() const { return end_of(count_); }

  /// The next interval, if it has ended at `until`.
  [[nodiscard]] std::optional<Interval> pass(geodesy::GpsTime until) {
    const Interval interval{end_of(count_), end_of(count_ + 1)};
    if (begin_ + interval.to_s > until) return std::nullopt;
    ++count_;
    return interval;
  }
  /// Passes the intervals that have ended at `time`; false: there is none.
  bool skip(geodesy::GpsTime time) {
    constexpr double kNanosecond = 1e-9;
    const auto count = static_cast<std::int64_t>(std::floor((time - begin_ + kNanosecond) * rate_hz_));
    if (count <= count_) return false;
    count_ = count;
    return true;
  }

 private:
  [[nodiscard]] double end_of(std::int64_t k) const {
    return std::round(static_cast<double>(k) / rate_hz_ * 1e9) / 1e9;
  }

  geodesy::GpsTime begin_;
  double rate_hz_;
  std::int64_t count_ = 0;
};

/// Position, velocity and attitude of a sensor in common units.
struct SensorMotion {
  SensorMotion(const inertial::BodyState& sensor, inertial::ImuAxes axes);

  Eigen::Vector3d position_deg_m;  ///< latitude, longitude [deg], height above the ellipsoid [m]
  Eigen::Vector3d velocity_enu_mps;
  Eigen::Vector3d attitude_deg;  ///< roll (left side up), pitch (nose up), heading from north, clockwise
};

/// A sample of an inertial sensor, and the truth at its instant.
struct InertialSample {
  geodesy::GpsTime time;                      ///< end of the sample's interval
  geodesy::GpsTime reported;                  ///< the same by the sensor's clock, if it is not lost
  inertial::ImuState truth;                   ///< position, motion and input of the sensor at `time`
  inertial::ImuInput mean;                    ///< true means over the interval
  std::optional<inertial::ImuSample> sample;  ///< time_s counts from the run's start; empty: lost
};

/// The samples of a vehicle's inertial sensor, in order. The same seed gives the same errors.
class InertialRun : public SampleTimes {
 public:
  /// @param vehicle its motion at any instant of the run and 5 ms around it; its acceleration is
  /// continuous. `begin`: the first sample ends one interval later.
  InertialRun(const inertial::ImuOptions& options, std::uint64_t seed, geodesy::GpsTime begin,
              const std::function<inertial::BodyState(geodesy::GpsTime)>& vehicle);

  /// The next sample, if its interval has ended at `until`.
  [[nodiscard]] std::optional<InertialSample> next(geodesy::GpsTime until);

 private:
  std::int64_t steps_;  // of ideal_ per sample
  inertial::IdealImu ideal_;
  inertial::Imu imu_;
};

/// A sensor on a vehicle whose pose is known at any instant of the run; the first sample ends one interval
/// after the start. The same seed gives the same errors.
template <typename Sensor, typename Options>
class PosedSensor : public SampleTimes {
 public:
  PosedSensor(const Options& options, std::uint64_t seed, geodesy::GpsTime begin,
              std::function<Pose(geodesy::GpsTime)> vehicle)
      : SampleTimes(begin, options.rate_hz),
        options_(options),
        vehicle_(std::move(vehicle)),
        sensor_(options, seed) {}

 protected:
  Options options_;
  std::function<Pose(geodesy::GpsTime)> vehicle_;
  Sensor sensor_;
};

/// A sample of a vehicle's wheels, and the truth.
struct WheelsAtWork {
  geodesy::GpsTime time;  ///< end of the sample's interval
  double dt_s = 0;        ///< its length
  inertial::WheelSample sample;
  inertial::WheelPair true_mps{};  ///< mean speeds over the interval
};

/// The samples of a vehicle's wheels, in order.
class WheelRun : public PosedSensor<inertial::Wheels, inertial::WheelOptions> {
 public:
  using PosedSensor::PosedSensor;
  /// The next sample, if its interval has ended at `until`.
  [[nodiscard]] std::optional<WheelsAtWork> next(geodesy::GpsTime until);
  /// Skips the samples whose intervals end until `time`.
  void skip(geodesy::GpsTime time);

 private:
  /// Forward speeds of the wheels' reference points at an instant.
  [[nodiscard]] inertial::WheelPair speeds(geodesy::GpsTime t) const;

  inertial::WheelPair last_ = speeds(begin());  // at the end of the last sample
};

/// The vehicle's velocities by the wheels of an axle, in its axes: forward, left, up.
struct WheelTwist {
  double forward_mps = 0, yaw_rate_radps = 0;
  /// Row by row, of linear velocities [m^2/s^2], then of angular ones [rad^2/s^2]. kUnknownVariance: not
  /// measured.
  std::array<double, 36> covariance{};
};
/// For unknown values in messages without a code for them: large, but finite, since nodes that rotate vectors
/// into other frames would spread a NaN.
inline constexpr double kUnknownVariance = 1e6;
/// The mean of both wheels, and their difference over the track width, if that is known. A wheel's variance
/// is t^2 / 6 + (scale^2 + slip^2) v^2, where t is the speed of one tick per sample: the count at each end of
/// the interval has a uniform error of one tick, of variance t^2 / 12. The axle slides by 0.05 m/s sideways
/// and 0.1 m/s upwards (assumed); roll and pitch rates are not measured.
[[nodiscard]] WheelTwist wheel_twist(const WheelsAtWork& wheels, const inertial::WheelOptions& options);

struct BarometerSample {
  geodesy::GpsTime time;
  double height_m = 0;          ///< of the barometer above mean sea level
  inertial::Pressure pressure;  ///< true_pa: at `time`
};

/// A barometer along a run.
class BarometerRun : public PosedSensor<inertial::Barometer, inertial::BarometerOptions> {
 public:
  /// @param geoid_undulation_m mean sea level above the ellipsoid, along the whole run
  BarometerRun(const inertial::BarometerOptions& options, std::uint64_t seed, geodesy::GpsTime begin,
               std::function<Pose(geodesy::GpsTime)> vehicle, double geoid_undulation_m)
      : PosedSensor(options, seed, begin, std::move(vehicle)), geoid_undulation_m_(geoid_undulation_m) {}
  /// The next sample, if it is due at `until`.
  [[nodiscard]] std::optional<BarometerSample> next(geodesy::GpsTime until);

 private:
  double geoid_undulation_m_;
};

struct MagnetometerSample {
  geodesy::GpsTime time;
  /// In the sensor's axes [T]; true: only Earth's field, at `time`.
  Eigen::Vector3d measured_t = Eigen::Vector3d::Zero(), true_t = measured_t;
};

/// A magnetometer along a run.
class MagnetometerRun : public PosedSensor<inertial::Magnetometer, inertial::MagnetometerOptions> {
 public:
  using PosedSensor::PosedSensor;
  /// The next sample, if it is due at `until`.
  [[nodiscard]] std::optional<MagnetometerSample> next(geodesy::GpsTime until);
};

/// Samples of a vehicle's sensors that ended since the previous epoch, in order. EpochSinks that use sensors
/// get them with each epoch, in runs and live sessions.
struct SensorBatch {
  inertial::ImuAxes imu_axes = inertial::ImuAxes::Flu, magnetometer_axes = inertial::ImuAxes::Flu;
  std::vector<InertialSample> imu;
  std::vector<WheelsAtWork> wheels;
  std::vector<BarometerSample> barometer;
  std::vector<MagnetometerSample> magnetometer;
};

/// The sensors of a vehicle, epoch by epoch.
class SensorRun {
 public:
  /// @param body the vehicle's smooth motion, for sensors that measure it (InertialRun)
  /// @param pose the vehicle's pose on the same path, over the terrain
  /// @param geoid_undulation_m mean sea level above the ellipsoid
  SensorRun(const inertial::SensorOptions& options, std::uint64_t seed, geodesy::GpsTime begin,
            const std::function<inertial::BodyState(geodesy::GpsTime)>& body,
            const std::function<Pose(geodesy::GpsTime)>& pose, double geoid_undulation_m) {
    if (options.imu) {
      imu_.emplace(*options.imu, seed, begin, body);
      batch_.imu_axes = options.imu->axes;
    }
    if (options.wheels) wheels_.emplace(*options.wheels, seed, begin, pose);
    if (options.barometer) barometer_.emplace(*options.barometer, seed, begin, pose, geoid_undulation_m);
    if (options.magnetometer) {
      magnetometer_.emplace(*options.magnetometer, seed, begin, pose);
      batch_.magnetometer_axes = options.magnetometer->axes;
    }
  }

  /// The samples since the last call. Valid until the next one.
  [[nodiscard]] const SensorBatch& until(geodesy::GpsTime time) {
    take(imu_, time, batch_.imu);
    take(wheels_, time, batch_.wheels);
    take(barometer_, time, batch_.barometer);
    take(magnetometer_, time, batch_.magnetometer);
    return batch_;
  }

  /// Skips the samples until `time`, for which there is no motion.
  void skip(geodesy::GpsTime time) {
    if (imu_) imu_->skip(time);
    if (wheels_) wheels_->skip(time);
    if (barometer_) barometer_->skip(time);
    if (magnetometer_) magnetometer_->skip(time);
  }

 private:
  template <typename ReceiverGroup, typename Sample>
  static void take(std::optional<ReceiverGroup>& run, geodesy::GpsTime until, std::vector<Sample>& samples) {
    samples.clear();
    while (run) {
      auto sample = run->next(until);
      if (!sample) break;
      samples.push_back(*sample);
    }
  }

  std::optional<InertialRun> imu_;
  std::optional<WheelRun> wheels_;
  std::optional<BarometerRun> barometer_;
  std::optional<MagnetometerRun> magnetometer_;
  SensorBatch batch_;
};

/// Sensors in a receiver's messages: none for a fixed receiver, since it is not on the vehicle.
[[nodiscard]] inertial::SensorOptions sensors_of(const Scenario& scenario, std::size_t receiver);

/// Throws InputError if a receiver with dead reckoning has no inertial sensor, or does not move.
void check_sensors(const inertial::SensorOptions& sensors, const ReceiverConfig& receiver);

/// The sensors of a vehicle for a receiver with dead reckoning, without readings: their positions and error
/// sizes. Empty for other receivers.
[[nodiscard]] std::optional<receiver::VehicleSensors> vehicle_sensors(const inertial::SensorOptions& sensors,
                                                                      const ReceiverConfig& receiver);

/// The samples of an epoch in the vehicle's axes. Lost samples are left out. @param begin of the run
[[nodiscard]] positioning::SensorReadings readings_of(const SensorBatch& batch,
                                                      const inertial::SensorOptions& sensors,
                                                      geodesy::GpsTime begin);

}  // namespace canyon::simulation
