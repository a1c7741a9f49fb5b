#include "canyon/simulation/sensors/magnetometer_run.hpp"

#include <algorithm>
#include <utility>

#include "canyon/geodesy/frames.hpp"
#include "canyon/geodesy/magnetic_field.hpp"

namespace canyon::simulation {
namespace {

/// The Earth's field in ENU at a pose, and the pose's axes.
struct FieldAt {
  FieldAt(const Pose& pose, const Eigen::Matrix3d& body_from_sensor) {
    field_enu_t = geodesy::enu_from_ecef_rotation(pose.position) *
                  geodesy::magnetic_field_tesla(geodesy::ecef_from_geodetic(pose.position), pose.time);
    const Eigen::Vector3d forward = pose.forward_enu(), up = pose.up_enu();
    Eigen::Matrix3d enu_from_body;
    enu_from_body << forward, up.cross(forward), up;
    enu_from_sensor = enu_from_body * body_from_sensor;
  }
  Eigen::Vector3d field_enu_t;
  Eigen::Matrix3d enu_from_sensor;
};

}  // namespace

MagnetometerRun::MagnetometerRun(const inertial::MagnetometerOptions& options, std::uint64_t seed,
                                 geodesy::GpsTime begin, std::function<Pose(geodesy::GpsTime)> vehicle)
    : options_(options),
      body_from_sensor_(body_from_sensor(options.orientation, options.axes)),
      times_(begin, options.rate_hz),
      vehicle_(std::move(vehicle)),
      magnetometer_(options, seed) {}

std::optional<MagnetometerSample> MagnetometerRun::next(geodesy::GpsTime until) {
  const auto interval = times_.next(until);
  if (!interval) return std::nullopt;
  MagnetometerSample sample;
  sample.time = times_.begin() + interval->to_s;
  const Pose pose = vehicle_(times_.begin() + std::max(0.0, interval->to_s - options_.delay_s));
  const FieldAt felt(pose, body_from_sensor_);
  sample.measured_t = magnetometer_.measure(felt.field_enu_t, felt.enu_from_sensor,
                                            pose.velocity_enu_mps.norm() / options_.rate_hz);
  const FieldAt now(options_.delay_s > 0 ? vehicle_(sample.time) : pose, body_from_sensor_);
  sample.true_t = now.enu_from_sensor.transpose() * now.field_enu_t;
  return sample;
}

}  // namespace canyon::simulation
