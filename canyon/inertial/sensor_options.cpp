#include "canyon/inertial/sensor_options.hpp"

#include "canyon/options/values.hpp"
#include "canyon/options/visitor.hpp"

namespace canyon::inertial {

namespace {

/// A section that makes the sensor where it stands.
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

void WheelOptions::validate() const {
  options::check(*this, "wheels");
}

void visit(options::Visitor& v, WheelOptions& o) {
  v.number({"rate_hz", "Hz", "samples; each has the ways since the one before"}, o.rate_hz, {1, 1000});
  v.number({"track_m", "m",
            "distance of the two wheels; the middle of their axle is the trajectory's point, and they do not "
            "steer"},
           o.track_m, {0, 10});
  v.number({"tick_m", "m", "way of one tick; 0: speeds are not rounded, and there are no ticks"}, o.tick_m,
           {0, 10});
  v.number({"scale", "", "standard deviation of each wheel's relative error, one for a run"}, o.scale,
           {0, 0.2});
  v.number({"slip", "", "standard deviation of each wheel's relative slip, which changes"}, o.slip, {0, 0.5});
  v.number({"slip_time_s", "s", "time constant of the slip"}, o.slip_time_s, {0.01, 1000});
  v.boolean({"direction", "", "sensors tell forwards from backwards; false: speeds have no sign"},
            o.direction);
  v.number({"minimum_mps", "m/s", "wheels that turn more slowly give no tick"}, o.minimum_mps, {0, 10});
}

}  // namespace canyon::inertial
