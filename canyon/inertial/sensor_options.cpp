#include "canyon/inertial/sensor_options.hpp"

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

}  // namespace canyon::inertial
