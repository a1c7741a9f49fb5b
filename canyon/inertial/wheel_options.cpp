#include "canyon/inertial/wheel_options.hpp"

#include "canyon/options/values.hpp"

namespace canyon::inertial {

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
