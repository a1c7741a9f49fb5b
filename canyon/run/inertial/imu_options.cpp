#include "canyon/run/inertial/imu_options.hpp"

#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <string_view>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/options/values.hpp"

namespace canyon::inertial {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

/// Numbers of a profile in the units of the options, in their order.
struct ProfileNumbers {
  std::array<double, 11> gyroscope;
  std::array<double, 10> accelerometer;
};

// Ideal; consumer: white noise, cross-axis sensitivity and change by temperature of TDK's ICM-42688-P, the
// rest assumed; automotive: assumed; tactical: Sensonor's STIM300 with 10 g accelerometers. docs/imu.md has
// them as a table.
constexpr std::array<ProfileNumbers, 4> kProfiles{{
    {{0, 0, 0, 0, 0, 0, 0, 0, kNone, 0, 0}, {0, 0, 0, 0, 0, 0, 0, kNone, 0, 0}},
    {{0.168, 5, 0, 0.5, 5000, 0.7, 36, 0.061, 2000, 18, 50},
     {0.0412, 0.04, 0, 20, 5000, 0.7, 0.488, 16, 0.15, 50}},
    {{0.2, 2.5, 0, 0.1, 2000, 0.2, 18, 0.0076, 250, 7, 25}, {0.04, 0.03, 0, 5, 2000, 0.2, 0.122, 4, 0.1, 25}},
    {{0.15, 0.5, 0, 0.0014, 500, 0.057, 1, 0, 400, 0.28, 0},
     {0.06, 0.05, 0, 0.75, 300, 0.057, 0, 10, 0.055, 0}},
}};

}  // namespace

ImuNumbers imu_numbers(const ImuOptions& options) {
  const ProfileNumbers& by_profile = kProfiles.at(static_cast<std::size_t>(options.profile));
  constexpr double kDeg_s = geodesy::kPi / 180, kDeg_h = kDeg_s / 3600, kSqrtHour = 60;
  constexpr double kMilliG = kStandardGravity / 1000, kPpm = 1e-6;
  ImuNumbers numbers;
  const auto& g = options.gyroscope;
  const auto& by_gyroscope = by_profile.gyroscope;
  numbers.gyroscope = {g.angle_random_walk_deg_sqrt_h.value_or(by_gyroscope[0]) * kDeg_s / kSqrtHour,
                       g.bias_instability_deg_h.value_or(by_gyroscope[1]) * kDeg_h,
                       g.rate_random_walk_deg_h_sqrt_h.value_or(by_gyroscope[2]) * kDeg_h / kSqrtHour,
                       g.turn_on_bias_deg_s.value_or(by_gyroscope[3]) * kDeg_s,
                       g.scale_ppm.value_or(by_gyroscope[4]) * kPpm,
                       g.misalignment_deg.value_or(by_gyroscope[5]) * kDeg_s,
                       g.g_sensitivity_deg_h_g.value_or(by_gyroscope[6]) * kDeg_h / kStandardGravity,
                       g.resolution_deg_s.value_or(by_gyroscope[7]) * kDeg_s,
                       g.range_deg_s.value_or(by_gyroscope[8]) * kDeg_s,
                       g.temperature_deg_h_k.value_or(by_gyroscope[9]) * kDeg_h,
                       g.scale_temperature_ppm_k.value_or(by_gyroscope[10]) * kPpm};
  const auto& a = options.accelerometer;
  const auto& by_accelerometer = by_profile.accelerometer;
  numbers.accelerometer = {
      a.velocity_random_walk_mps_sqrt_h.value_or(by_accelerometer[0]) / kSqrtHour,
      a.bias_instability_mg.value_or(by_accelerometer[1]) * kMilliG,
      a.acceleration_random_walk_mg_sqrt_h.value_or(by_accelerometer[2]) * kMilliG / kSqrtHour,
      a.turn_on_bias_mg.value_or(by_accelerometer[3]) * kMilliG,
      a.scale_ppm.value_or(by_accelerometer[4]) * kPpm,
      a.misalignment_deg.value_or(by_accelerometer[5]) * kDeg_s,
      0,
      a.resolution_mg.value_or(by_accelerometer[6]) * kMilliG,
      a.range_g.value_or(by_accelerometer[7]) * kStandardGravity,
      a.temperature_mg_k.value_or(by_accelerometer[8]) * kMilliG,
      a.scale_temperature_ppm_k.value_or(by_accelerometer[9]) * kPpm};
  return numbers;
}

Eigen::Matrix3d body_from_sensor(const Orientation& orientation, ImuAxes axes) {
  const auto about = [](double angle_deg, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(geodesy::radians(angle_deg), axis);
  };
  Eigen::Matrix3d rotation = (about(orientation.yaw_deg, Eigen::Vector3d::UnitZ()) *
                              about(-orientation.pitch_deg, Eigen::Vector3d::UnitY()) *
                              about(orientation.roll_deg, Eigen::Vector3d::UnitX()))
                                 .toRotationMatrix();
  if (axes == ImuAxes::Frd) rotation *= Eigen::Vector3d(1, -1, -1).asDiagonal();
  return rotation;
}

void visit_axes(options::Visitor& v, ImuAxes& axes) {
  static constexpr std::string_view kAxesWords[]{"flu", "frd"};
  v.choice({"axes", "", "axes of the samples: flu (forward, left, up) or frd (forward, right, down)"}, axes,
           kAxesWords);
}

void visit_orientation(options::Visitor& v, Orientation& o) {
  v.section("orientation", [&] {
    v.number(
        {"roll_deg", "deg", "turn of the sensor about its forward axis, left side up; after pitch and yaw"},
        o.roll_deg, {-180, 180});
    v.number({"pitch_deg", "deg", "turn about its left axis, nose up; after yaw"}, o.pitch_deg, {-90, 90});
    v.number({"yaw_deg", "deg", "turn about the vehicle's up axis, to the left"}, o.yaw_deg, {-180, 180});
  });
}

void visit(options::Visitor& v, ImuOptions& o) {
  static constexpr std::string_view kProfileWords[]{"ideal", "consumer", "automotive", "tactical"};
  static constexpr std::string_view kBy = "by profile";
  static constexpr const char* kPerKelvin =
      "standard deviation of the bias for each K of the sensor over 25 deg C";
  static constexpr const char* kScalePerKelvin =
      "standard deviation of the scale factor for each K of the sensor over 25 deg C";
  v.choice(
      {"profile", "",
       "class of sensors, which gives the defaults of their numbers: ideal, consumer, automotive, tactical"},
      o.profile, kProfileWords);
  v.number({"rate_hz", "Hz", "samples; each is the mean since the one before"}, o.rate_hz, {1, 10'000});
  visit_axes(v, o.axes);
  v.section("position", [&] {
    v.number({"forward_m", "m", "sensor ahead of the trajectory's point"}, o.position_m.x(), {-1000, 1000});
    v.number({"left_m", "m", "sensor to the left of that point"}, o.position_m.y(), {-1000, 1000});
    v.number({"up_m", "m", "sensor above that point"}, o.position_m.z(), {-1000, 1000});
  });
  visit_orientation(v, o.orientation);
  v.section("gyroscope", [&] {
    GyroscopeOptions& g = o.gyroscope;
    v.number({"angle_random_walk_deg_sqrt_h", "deg/sqrt(h)", "white noise of the rate", kBy},
             g.angle_random_walk_deg_sqrt_h, {0, 100});
    v.number({"bias_instability_deg_h", "deg/h", "1/f noise: lowest Allan deviation", kBy},
             g.bias_instability_deg_h, {0, 1e5});
    v.number({"rate_random_walk_deg_h_sqrt_h", "deg/h/sqrt(h)", "random walk of the bias", kBy},
             g.rate_random_walk_deg_h_sqrt_h, {0, 1e5});
    v.number({"turn_on_bias_deg_s", "deg/s", "standard deviation of the bias of a run", kBy},
             g.turn_on_bias_deg_s, {0, 100});
    v.number({"scale_ppm", "ppm", "standard deviation of the scale factor", kBy}, g.scale_ppm, {0, 1e5});
    v.number({"misalignment_deg", "deg", "standard deviation of an axis towards each other one", kBy},
             g.misalignment_deg, {0, 10});
    v.number({"g_sensitivity_deg_h_g", "deg/h/g", "standard deviation of the bias by specific force", kBy},
             g.g_sensitivity_deg_h_g, {0, 1e5});
    v.number({"resolution_deg_s", "deg/s", "step of the values; 0: not rounded", kBy}, g.resolution_deg_s,
             {0, 10});
    v.number({"range_deg_s", "deg/s", "largest value; none: no limit", kBy}, g.range_deg_s,
             options::or_none({0, 1e6, true}));
    v.number({"temperature_deg_h_k", "deg/h/K", kPerKelvin, kBy}, g.temperature_deg_h_k, {0, 1e4});
    v.number({"scale_temperature_ppm_k", "ppm/K", kScalePerKelvin, kBy}, g.scale_temperature_ppm_k, {0, 1e4});
  });
  v.section("accelerometer", [&] {
    AccelerometerOptions& a = o.accelerometer;
    v.number({"velocity_random_walk_mps_sqrt_h", "m/s/sqrt(h)", "white noise of the specific force", kBy},
             a.velocity_random_walk_mps_sqrt_h, {0, 100});
    v.number({"bias_instability_mg", "mg", "1/f noise: lowest Allan deviation", kBy}, a.bias_instability_mg,
             {0, 1000});
    v.number({"acceleration_random_walk_mg_sqrt_h", "mg/sqrt(h)", "random walk of the bias", kBy},
             a.acceleration_random_walk_mg_sqrt_h, {0, 1000});
    v.number({"turn_on_bias_mg", "mg", "standard deviation of the bias of a run", kBy}, a.turn_on_bias_mg,
             {0, 1000});
    v.number({"scale_ppm", "ppm", "standard deviation of the scale factor", kBy}, a.scale_ppm, {0, 1e5});
    v.number({"misalignment_deg", "deg", "standard deviation of an axis towards each other one", kBy},
             a.misalignment_deg, {0, 10});
    v.number({"resolution_mg", "mg", "step of the values; 0: not rounded", kBy}, a.resolution_mg, {0, 1000});
    v.number({"range_g", "g", "largest value; none: no limit", kBy}, a.range_g,
             options::or_none({0, 1e6, true}));
    v.number({"temperature_mg_k", "mg/K", kPerKelvin, kBy}, a.temperature_mg_k, {0, 100});
    v.number({"scale_temperature_ppm_k", "ppm/K", kScalePerKelvin, kBy}, a.scale_temperature_ppm_k, {0, 1e4});
  });
  v.section("temperature", [&] {
    v.number({"air_c", "deg C", "of the air about the sensor"}, o.temperature.air_c, {-60, 85});
    v.number({"warming_k", "K", "how much warmer than the air the sensor becomes"}, o.temperature.warming_k,
             {-100, 100});
    v.number({"warming_time_s", "s", "time constant of that"}, o.temperature.warming_time_s, {1, 100000});
  });
  v.list("vibration", o.vibration, [&](VibrationOptions& each) {
    v.number({"frequency_hz", "Hz", "of rotors, an engine or a wheel; also above half the sensor's rate"},
             each.frequency_hz, {0, 1e5, true});
    v.number({"bandwidth_hz", "Hz", "full width of the band at half its power; 0: a sinusoid"},
             each.bandwidth_hz, {0, 1000});
    v.number({"acceleration_mps2", "m/s^2", "amplitude of each axis"}, each.acceleration_mps2, {0, 1000});
    v.number({"rate_deg_s", "deg/s", "amplitude about each axis"}, each.rate_deg_s, {0, 1000});
  });
  v.number({"time_offset_s", "s", "stated times less the true ones"}, o.time_offset_s, {-10, 10});
  v.number({"time_jitter_s", "s", "standard deviation of the stated times"}, o.time_jitter_s, {0, 1});
  v.number({"lost", "", "share of samples that are lost"}, o.lost, {0, 1, false, true});
}

}  // namespace canyon::inertial
