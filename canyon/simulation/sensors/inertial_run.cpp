#include "canyon/simulation/sensors/inertial_run.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "canyon/geodesy/constants.hpp"
#include "canyon/simulation/motion/smooth_motion.hpp"
#include "canyon/simulation/sensors/sample_times.hpp"

namespace canyon::simulation {

using Eigen::Vector3d;
using geodesy::GpsTime;

inertial::BodyState body_state(const Pose& pose) {
  const Eigen::Matrix3d ecef_from_enu = geodesy::enu_from_ecef_rotation(pose.position).transpose();
  return {geodesy::ecef_from_geodetic(pose.position), ecef_from_enu * pose.velocity_enu_mps,
          ecef_from_enu * pose.acceleration_enu_mps2, ecef_from_enu * enu_from_body(pose)};
}

std::function<inertial::BodyState(GpsTime)> body_along(const Trajectory& trajectory) {
  return [&trajectory](GpsTime t) -> inertial::BodyState {
    const std::optional<EcefPose> rigid = trajectory.ecef_pose(t);
    if (!rigid) return body_state(trajectory.at(t));
    return {rigid->position_m, rigid->velocity_mps, rigid->acceleration_mps2, rigid->ecef_from_body};
  };
}

SensorMotion::SensorMotion(const inertial::BodyState& sensor, inertial::ImuAxes axes) {
  const geodesy::Geodetic place = geodesy::geodetic_from_ecef(sensor.position_m);
  const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(place);
  place_deg_m = {geodesy::degrees(place.latitude_rad), geodesy::degrees(place.longitude_rad), place.height_m};
  velocity_enu_mps = enu_from_ecef * sensor.velocity_mps;
  const Eigen::Matrix3d enu_from_sensor = enu_from_ecef * sensor.ecef_from_body;
  const Vector3d forward = enu_from_sensor.col(0);
  const double side = axes == inertial::ImuAxes::Frd ? -1 : 1;  // to the left and up
  const double heading_deg = geodesy::degrees(std::atan2(forward.x(), forward.y()));
  attitude_deg = {geodesy::degrees(std::atan2(side * enu_from_sensor(2, 1), side * enu_from_sensor(2, 2))),
                  geodesy::degrees(std::asin(std::clamp(forward.z(), -1.0, 1.0))),
                  heading_deg < 0 ? heading_deg + 360 : heading_deg};
}

namespace {

/// Steps of a sample's mean: even, and at most 2.5 ms each.
std::int64_t steps_of(double rate_hz) {
  constexpr double kStep_s = 0.0025;
  return 2 * static_cast<std::int64_t>(std::ceil(1 / rate_hz / (2 * kStep_s) - 1e-9));
}

}  // namespace

InertialRun::InertialRun(const inertial::ImuOptions& options, std::uint64_t seed, GpsTime begin,
                         const std::function<inertial::BodyState(GpsTime)>& vehicle)
    : times_(begin, options.rate_hz),
      steps_(steps_of(options.rate_hz)),
      ideal_(
          options, [begin, vehicle](double t_s) { return vehicle(begin + t_s); },
          1 / options.rate_hz / static_cast<double>(steps_)),
      imu_(options, seed) {}

std::optional<InertialSample> InertialRun::next(GpsTime until) {
  const auto interval = times_.next(until);
  if (!interval) return std::nullopt;
  const std::int64_t end = times_.count() * steps_;
  InertialSample sample;
  sample.time = times_.begin() + interval->to_s;
  sample.mean = ideal_.mean(end - steps_, end);
  sample.truth = ideal_.at(end);
  sample.sample = imu_.measure(sample.mean, interval->to_s, interval->to_s - interval->from_s);
  if (sample.sample) sample.stated = times_.begin() + sample.sample->time_s;
  return sample;
}

}  // namespace canyon::simulation
