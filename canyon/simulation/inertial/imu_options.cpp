#include "canyon/simulation/inertial/imu_options.hpp"

#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <string_view>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"

namespace canyon::inertial {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();
constexpr double kDeg_s = geodesy::kPi / 180, kDeg_h = kDeg_s / 3600, kSqrtHour = 60;
constexpr double kMilliG = kStandardGravity / 1000, kPpm = 1e-6;

constexpr const char* kScale = "standard deviation of the scale factor";
constexpr const char* kMisalignment = "standard deviation of an axis towards each other one";
constexpr const char* kPerKelvin = "standard deviation of the bias per K of the sensor over 25 deg C";
constexpr const char* kScalePerKelvin =
    "standard deviation of the scale factor per K of the sensor over 25 deg C";

/// Visits the fields of a sensor's numbers, or returns their values: the options', if empty the profile's.
struct NumbersOf {
  options::Visitor* fields;  ///< null: values are returned
  ImuProfile profile;

  /// @param number in SI units, times / over of the key's @param by_profile in the key's unit
  void operator()(std::string_view key, std::string_view unit, std::string_view help,
                  std::optional<double>& given, const options::Range& range, double& number, double times,
                  double over, const std::array<double, 4>& by_profile) const {
    if (fields != nullptr) fields->number({key, unit, help, "by profile"}, given, range);
    number = given.value_or(by_profile.at(static_cast<std::size_t>(profile))) * times / over;
  }
};

// Ideal; consumer: white noise, cross-axis sensitivity and change by temperature of TDK's ICM-42688-P, the
// rest assumed; automotive: assumed; tactical: Sensonor's STIM300 with 10 g accelerometers. docs/imu.md has a
// table of them.
TriadNumbers numbers_of(GyroscopeOptions& g, const NumbersOf& number) {
  TriadNumbers n;
  number("angle_random_walk_deg_sqrt_h", "deg/sqrt(h)", "white noise of the rate",
         g.angle_random_walk_deg_sqrt_h, {0, 100}, n.white, kDeg_s, kSqrtHour, {0, 0.168, 0.2, 0.15});
  number("bias_instability_deg_h", "deg/h", "1/f noise: lowest Allan deviation", g.bias_instability_deg_h,
         {0, 1e5}, n.flicker, kDeg_h, 1, {0, 5, 2.5, 0.5});
  number("rate_random_walk_deg_h_sqrt_h", "deg/h/sqrt(h)", "random walk of the bias",
         g.rate_random_walk_deg_h_sqrt_h, {0, 1e5}, n.walk, kDeg_h, kSqrtHour, {});
  number("turn_on_bias_deg_s", "deg/s", "standard deviation of the bias of a run", g.turn_on_bias_deg_s,
         {0, 100}, n.turn_on, kDeg_s, 1, {0, 0.5, 0.1, 0.0014});
  number("scale_ppm", "ppm", kScale, g.scale_ppm, {0, 1e5}, n.scale, kPpm, 1, {0, 5000, 2000, 500});
  number("misalignment_deg", "deg", kMisalignment, g.misalignment_deg, {0, 10}, n.misalignment, kDeg_s, 1,
         {0, 0.7, 0.2, 0.057});
  number("g_sensitivity_deg_h_g", "deg/h/g", "standard deviation of the bias by specific force",
         g.g_sensitivity_deg_h_g, {0, 1e5}, n.per_force, kDeg_h, kStandardGravity, {0, 36, 18, 1});
  number("resolution_deg_s", "deg/s", "step of the values; 0: not rounded", g.resolution_deg_s, {0, 10},
         n.resolution, kDeg_s, 1, {0, 0.061, 0.0076, 0});
  number("range_deg_s", "deg/s", "largest value; none: no limit", g.range_deg_s,
         options::or_none({0, 1e6, true}), n.range, kDeg_s, 1, {kNone, 2000, 250, 400});
  number("temperature_deg_h_k", "deg/h/K", kPerKelvin, g.temperature_deg_h_k, {0, 1e4}, n.per_kelvin, kDeg_h,
         1, {0, 18, 7, 0.28});
  number("scale_temperature_ppm_k", "ppm/K", kScalePerKelvin, g.scale_temperature_ppm_k, {0, 1e4},
         n.scale_per_kelvin, kPpm, 1, {0, 50, 25, 0});
  return n;
}

TriadNumbers numbers_of(AccelerometerOptions& a, const NumbersOf& number) {
  TriadNumbers n;
  number("velocity_random_walk_mps_sqrt_h", "m/s/sqrt(h)", "white noise of the specific force",
         a.velocity_random_walk_mps_sqrt_h, {0, 100}, n.white, 1, kSqrtHour, {0, 0.0412, 0.04, 0.06});
  number("bias_instability_mg", "mg", "1/f noise: lowest Allan deviation", a.bias_instability_mg, {0, 1000},
         n.flicker, kMilliG, 1, {0, 0.04, 0.03, 0.05});
  number("acceleration_random_walk_mg_sqrt_h", "mg/sqrt(h)", "random walk of the bias",
         a.acceleration_random_walk_mg_sqrt_h, {0, 1000}, n.walk, kMilliG, kSqrtHour, {});
  number("turn_on_bias_mg", "mg", "standard deviation of the bias of a run", a.turn_on_bias_mg, {0, 1000},
         n.turn_on, kMilliG, 1, {0, 20, 5, 0.75});
  number("scale_ppm", "ppm", kScale, a.scale_ppm, {0, 1e5}, n.scale, kPpm, 1, {0, 5000, 2000, 300});
  number("misalignment_deg", "deg", kMisalignment, a.misalignment_deg, {0, 10}, n.misalignment, kDeg_s, 1,
         {0, 0.7, 0.2, 0.057});
  number("resolution_mg", "mg", "step of the values; 0: not rounded", a.resolution_mg, {0, 1000},
         n.resolution, kMilliG, 1, {0, 0.488, 0.122, 0});
  number("range_g", "g", "largest value; none: no limit", a.range_g, options::or_none({0, 1e6, true}),
         n.range, kStandardGravity, 1, {kNone, 16, 4, 10});
  number("temperature_mg_k", "mg/K", kPerKelvin, a.temperature_mg_k, {0, 100}, n.per_kelvin, kMilliG, 1,
         {0, 0.15, 0.1, 0.055});
  number("scale_temperature_ppm_k", "ppm/K", kScalePerKelvin, a.scale_temperature_ppm_k, {0, 1e4},
         n.scale_per_kelvin, kPpm, 1, {0, 50, 25, 0});
  return n;
}

}  // namespace

ImuNumbers imu_numbers(const ImuOptions& options) {
  ImuOptions o = options;
  return {numbers_of(o.gyroscope, {nullptr, o.profile}), numbers_of(o.accelerometer, {nullptr, o.profile})};
}

Eigen::Matrix3d body_from_sensor(const SensorOrientation& orientation, ImuAxes axes) {
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

void visit_orientation(options::Visitor& v, SensorOrientation& o) {
  v.section("orientation", [&] {
    v.number({"roll_deg", "deg",
              "rotation of the sensor about its forward axis, left side up; after pitch and yaw"},
             o.roll_deg, {-180, 180});
    v.number({"pitch_deg", "deg", "rotation about its left axis, nose up; after yaw"}, o.pitch_deg,
             {-90, 90});
    v.number({"yaw_deg", "deg", "rotation about the vehicle's up axis, to the left"}, o.yaw_deg, {-180, 180});
  });
}

void visit(options::Visitor& v, ImuOptions& o) {
  static constexpr std::string_view kProfileWords[]{"ideal", "consumer", "automotive", "tactical"};
  v.choice(
      {"profile", "",
       "class of sensors, which sets the defaults of their numbers: ideal, consumer, automotive, tactical"},
      o.profile, kProfileWords);
  v.number({"rate_hz", "Hz", "samples; each is the mean since the previous one"}, o.rate_hz, {1, 10'000});
  visit_axes(v, o.axes);
  v.section("position", [&] {
    v.number({"forward_m", "m", "sensor ahead of the trajectory's point"}, o.position_m.x(), {-1000, 1000});
    v.number({"left_m", "m", "sensor to the left of that point"}, o.position_m.y(), {-1000, 1000});
    v.number({"up_m", "m", "sensor above that point"}, o.position_m.z(), {-1000, 1000});
  });
  visit_orientation(v, o.orientation);
  v.section("gyroscope", [&] { (void)numbers_of(o.gyroscope, {&v, o.profile}); });
  v.section("accelerometer", [&] { (void)numbers_of(o.accelerometer, {&v, o.profile}); });
  v.section("temperature", [&] {
    v.number({"air_c", "deg C", "temperature of the air around the sensor"}, o.temperature.air_c, {-60, 85});
    v.number({"warming_k", "K", "how much warmer than the air the sensor becomes"}, o.temperature.warming_k,
             {-100, 100});
    v.number({"warming_time_s", "s", "time constant of warming"}, o.temperature.warming_time_s, {1, 100000});
  });
  v.list("vibration", o.vibration, [&](VibrationOptions& each) {
    v.number({"frequency_hz", "Hz", "of rotors, an engine or a wheel; also above half the sensor's rate"},
             each.frequency_hz, {0, 1e5, true});
    v.number({"bandwidth_hz", "Hz", "full width of the band at half its power; 0: a sinusoid"},
             each.bandwidth_hz, {0, 1000});
    v.number({"acceleration_mps2", "m/s^2", "amplitude of each axis"}, each.acceleration_mps2, {0, 1000});
    v.number({"rate_deg_s", "deg/s", "amplitude about each axis"}, each.rate_deg_s, {0, 1000});
  });
  v.number({"time_offset_s", "s", "time stamps minus the true times"}, o.time_offset_s, {-10, 10});
  v.number({"time_jitter_s", "s", "standard deviation of the time stamps"}, o.time_jitter_s, {0, 1});
  v.number({"loss_fraction", "", "fraction of samples that are lost"}, o.lost, {0, 1, false, true});
  v.former_name("lost", "loss_fraction");
  v.list("frozen", o.frozen, [&](SensorFault& each) { visit(v, each); });
}

void visit(options::Visitor& v, SensorFault& o) {
  constexpr options::Range kTimes{0, 1e8};
  v.number({"from_s", "s", "start of a failure of the sensor, since the start of the run"}, o.from_s, kTimes);
  v.number({"until_s", "s", "end of the failure"}, o.until_s, kTimes);
}

}  // namespace canyon::inertial
