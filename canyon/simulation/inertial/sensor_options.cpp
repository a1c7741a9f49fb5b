#include "canyon/simulation/inertial/sensor_options.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"

namespace canyon::inertial {

namespace {

// MS5611-01BA03 (TE Connectivity): noise at 4,096 samples of oversampling; accuracy of 150 Pa at 25 deg C,
// used as two deviations; 250 Pa from -20 to 85 deg C. BMP388 (Bosch, BST-BMP388-DS001): noise and step of
// the setting for drones; typical accuracy; offset by temperature. The drifts are assumed.
constexpr std::array<BarometerNumbers, 3> kBarometers{{
    {},
    {1.2, 75, 5, 0.8, 0},
    {1.3, 50, 5, 0.75, 0.33},
}};

}  // namespace

BarometerNumbers barometer_numbers(const BarometerOptions& o) {
  const BarometerNumbers& part = kBarometers.at(static_cast<std::size_t>(o.profile));
  return {o.noise_pa.value_or(part.noise_pa), o.turn_on_pa.value_or(part.turn_on_pa),
          o.drift_pa.value_or(part.drift_pa), o.temperature_pa_k.value_or(part.temperature_pa_k),
          o.resolution_pa.value_or(part.resolution_pa)};
}

void visit(options::Visitor& v, BarometerOptions& o) {
  static constexpr std::string_view kProfileWords[]{"ideal", "ms5611", "bmp388"};
  static constexpr std::string_view kBy = "by profile";
  v.choice({"profile", "", "sensor model, which sets the defaults of its numbers: ideal, ms5611, bmp388"},
           o.profile, kProfileWords);
  v.number({"rate_hz", "Hz", "samples"}, o.rate_hz, {0.1, 1000});
  v.section("position", [&] {
    v.number({"forward_m", "m", "barometer ahead of the trajectory's point"}, o.position_m.x(),
             {-1000, 1000});
    v.number({"left_m", "m", "barometer to the left of that point"}, o.position_m.y(), {-1000, 1000});
    v.number({"up_m", "m", "barometer above that point"}, o.position_m.z(), {-1000, 1000});
  });
  v.number({"sea_level_pressure_pa", "Pa", "of the air at mean sea level when the run begins"},
           o.sea_level_pressure_pa, {85000, 110000});
  v.number(
      {"sea_level_temperature_c", "deg C", "of the air at mean sea level; it falls by 6.5 K a kilometre"},
      o.sea_level_temperature_c, {-60, 50});
  v.number({"pressure_change_pa_h", "Pa/h", "change of the day's pressure: weather"}, o.pressure_change_pa_h,
           {-2000, 2000});
  v.number({"noise_pa", "Pa", "standard deviation of each sample's noise", kBy}, o.noise_pa, {0, 1000});
  v.number({"turn_on_pa", "Pa", "standard deviation of the error of a run", kBy}, o.turn_on_pa, {0, 5000});
  v.number({"drift_pa", "Pa", "standard deviation of an error that changes slowly", kBy}, o.drift_pa,
           {0, 5000});
  v.number(
      {"temperature_pa_k", "Pa/K", "standard deviation of the error per K of the sensor over 25 deg C", kBy},
      o.temperature_pa_k, {0, 100});
  v.number({"airflow", "",
            "fraction of the dynamic pressure of the vehicle's speed in the reading; -1 to 1 by the position "
            "of the opening"},
           o.airflow, {-2, 2});
  v.number({"resolution_pa", "Pa", "step of the reading; 0: none", kBy}, o.resolution_pa, {0, 1000});
}

namespace {

constexpr double kNoRange = std::numeric_limits<double>::infinity();

// Noise, bias instability, hard iron [uT], soft iron, resolution, range [uT]. IST8310 (iSentek): step and
// range; RM3100 (PNI) at 200 cycle counts: noise, step, range. The rest is assumed.
constexpr std::array<std::array<double, 6>, 3> kMagnetometers{{
    {0, 0, 0, 0, 0, kNoRange},
    {0.3, 0.05, 10, 0.03, 0.3, 1600},
    {0.015, 0.005, 10, 0.03, 0.0133, 800},
}};

}  // namespace

TriadNumbers magnetometer_numbers(const MagnetometerOptions& o) {
  const auto& part = kMagnetometers.at(static_cast<std::size_t>(o.profile));
  constexpr double kMicro = 1e-6;
  TriadNumbers numbers;
  // Each sample has the noise of its interval.
  numbers.white = o.noise_ut.value_or(part[0]) * kMicro / std::sqrt(o.rate_hz);
  numbers.flicker = o.bias_instability_ut.value_or(part[1]) * kMicro;
  numbers.turn_on = o.hard_iron_ut.value_or(part[2]) * kMicro;
  numbers.scale = numbers.misalignment = o.soft_iron.value_or(part[3]);
  numbers.resolution = o.resolution_ut.value_or(part[4]) * kMicro;
  numbers.range = o.range_ut.value_or(part[5]) * kMicro;
  return numbers;
}

void visit(options::Visitor& v, MagnetometerOptions& o) {
  static constexpr std::string_view kProfileWords[]{"ideal", "ist8310", "rm3100"};
  static constexpr std::string_view kBy = "by profile";
  v.choice({"profile", "", "sensor model, which sets the defaults of its numbers: ideal, ist8310, rm3100"},
           o.profile, kProfileWords);
  v.number({"rate_hz", "Hz", "samples"}, o.rate_hz, {0.1, 1000});
  visit_axes(v, o.axes);
  visit_orientation(v, o.orientation);
  v.number({"noise_ut", "uT", "standard deviation of each sample's noise", kBy}, o.noise_ut, {0, 100});
  v.number({"bias_instability_ut", "uT", "1/f noise: lowest Allan deviation", kBy}, o.bias_instability_ut,
           {0, 100});
  v.number({"hard_iron_ut", "uT", "standard deviation of each component of the vehicle's own field", kBy},
           o.hard_iron_ut, {0, 1000});
  v.number({"soft_iron", "", "standard deviation of each element of the matrix that distorts the field", kBy},
           o.soft_iron, {0, 1});
  v.number({"resolution_ut", "uT", "step of the values; 0: not rounded", kBy}, o.resolution_ut, {0, 100});
  v.number({"range_ut", "uT", "largest value; none: no limit", kBy}, o.range_ut,
           options::or_none({0, 1e6, true}));
  v.number({"roadside_field_ut", "uT",
            "standard deviation of the field of steel along the road, in each axis; varies with distance"},
           o.surroundings_ut, {0, 1000});
  v.former_name("surroundings_ut", "roadside_field_ut");
}

namespace {

/// A section that creates the sensor if it is present.
template <typename Options>
void visit_sensor(options::Visitor& v, const char* name, std::optional<Options>& sensor) {
  if (!v.wants(v.reads() ? v.has(name) : sensor.has_value())) return;
  Options options = sensor.value_or(Options{});
  v.part(name, options);
  if (v.reads()) sensor = options;
}

}  // namespace

void visit(options::Visitor& v, SensorOptions& o) {
  visit_sensor(v, "imu", o.imu);
  visit_sensor(v, "wheels", o.wheels);
  visit_sensor(v, "barometer", o.barometer);
  visit_sensor(v, "magnetometer", o.magnetometer);
}

void visit(options::Visitor& v, WheelOptions& o) {
  v.number({"rate_hz", "Hz", "samples; each has the distances since the previous one"}, o.rate_hz, {1, 1000});
  v.number({"track_m", "m",
            "distance of the two wheels; the middle of their axle is the trajectory's point, and they do not "
            "steer"},
           o.track_m, {0, 10});
  v.number({"tick_m", "m", "distance of one tick; 0: speeds are not rounded, there are no ticks"}, o.tick_m,
           {0, 10});
  v.number({"scale", "", "standard deviation of each wheel's relative error, one for a run"}, o.scale,
           {0, 0.2});
  v.number({"slip", "", "standard deviation of each wheel's relative slip, which changes"}, o.slip, {0, 0.5});
  v.number({"slip_time_s", "s", "time constant of the slip"}, o.slip_time_s, {0.01, 1000});
  v.boolean({"direction", "", "sensors distinguish forwards from backwards; false: speeds have no sign"},
            o.direction);
  v.list("slips", o.slips, [&](SensorFault& each) {
    visit(v, each);
    v.number({"factor", "", "measured distance over the true one: 3 spins, 0 blocks"}, each.factor, {0, 100});
  });
}

}  // namespace canyon::inertial
