#include "canyon/output/sensor_arrays.hpp"

#include <algorithm>
#include <limits>

namespace canyon::output {
namespace {

using Eigen::Vector3d;
using simulation::SensorBatch;

constexpr double kNoSample = std::numeric_limits<double>::quiet_NaN();

/// Appends the values of a sample to consecutive arrays.
class SampleWriter {
 public:
  SampleWriter(std::vector<SensorArray>& arrays, const std::string& sensor)
      : at_(std::find_if(arrays.begin(), arrays.end(),
                         [&](const SensorArray& array) { return array.sensor == sensor; })) {}
  SampleWriter& operator<<(double value) {
    (at_++)->values.push_back(value);
    return *this;
  }
  SampleWriter& operator<<(const Vector3d& value) {
    at_->values.insert(at_->values.end(), value.data(), value.data() + 3);
    ++at_;
    return *this;
  }
  SampleWriter& operator<<(const inertial::WheelPair& value) {
    at_->values.insert(at_->values.end(), value.begin(), value.end());
    ++at_;
    return *this;
  }

 private:
  std::vector<SensorArray>::iterator at_;
};

}  // namespace

SensorArrays::SensorArrays(const inertial::SensorOptions& sensors, geodesy::GpsTime begin)
    : sensors_(sensors), begin_(begin) {
  if (sensors.imu) {
    arrays_.insert(arrays_.end(), {{"imu", "time_s"},
                                   {"imu", "stated_s"},
                                   {"imu", "specific_force", 3},
                                   {"imu", "angular_rate", 3},
                                   {"imu", "true_specific_force", 3},
                                   {"imu", "true_angular_rate", 3},
                                   {"imu", "place", 3},
                                   {"imu", "velocity", 3},
                                   {"imu", "attitude", 3},
                                   {"imu", "temperature"}});
  }
  if (sensors.wheels) {
    arrays_.insert(
        arrays_.end(),
        {{"wheels", "time_s"}, {"wheels", "speed", 2}, {"wheels", "ticks", 2}, {"wheels", "true_speed", 2}});
  }
  if (sensors.barometer) {
    arrays_.insert(arrays_.end(), {{"barometer", "time_s"},
                                   {"barometer", "pressure"},
                                   {"barometer", "altitude"},
                                   {"barometer", "temperature"},
                                   {"barometer", "sensor_temperature"},
                                   {"barometer", "true_pressure"},
                                   {"barometer", "true_height"}});
  }
  if (sensors.magnetometer) {
    arrays_.insert(
        arrays_.end(),
        {{"magnetometer", "time_s"}, {"magnetometer", "field", 3}, {"magnetometer", "true_field", 3}});
  }
}

void SensorArrays::add(const SensorBatch& batch) {
  for (const simulation::InertialSample& sample : batch.imu) {
    const simulation::SensorMotion motion(sample.truth.sensor, sensors_.imu->axes);
    const Vector3d none = Vector3d::Constant(kNoSample);
    const auto& stated = sample.sample;
    SampleWriter(arrays_, "imu") << sample.time - begin_ << (stated ? stated->time_s : kNoSample)
                                 << (stated ? stated->measured.specific_force_mps2 : none)
                                 << (stated ? stated->measured.angular_rate_radps : none)
                                 << sample.mean.specific_force_mps2 << sample.mean.angular_rate_radps
                                 << motion.place_deg_m << motion.velocity_enu_mps << motion.attitude_deg
                                 << (stated ? stated->temperature_k : kNoSample);
  }
  for (const simulation::WheelsAtWork& sample : batch.wheels) {
    inertial::WheelPair ticks{kNoSample, kNoSample};
    if (const auto& counted = sample.sample.ticks)
      ticks = {static_cast<double>((*counted)[0]), static_cast<double>((*counted)[1])};
    SampleWriter(arrays_, "wheels") << sample.time - begin_ << sample.sample.speed_mps << ticks
                                    << sample.true_mps;
  }
  for (const simulation::BarometerSample& sample : batch.barometer) {
    const inertial::Pressure& p = sample.pressure;
    SampleWriter(arrays_, "barometer")
        << sample.time - begin_ << p.measured_pa << inertial::pressure_altitude_m(p.measured_pa)
        << p.temperature_k << p.sensor_temperature_k << p.true_pa << sample.height_m;
  }
  for (const simulation::MagnetometerSample& sample : batch.magnetometer) {
    constexpr double kMicro = 1e6;
    SampleWriter(arrays_, "magnetometer")
        << sample.time - begin_ << kMicro * sample.measured_t << kMicro * sample.true_t;
  }
}

}  // namespace canyon::output
