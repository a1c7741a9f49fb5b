#include "canyon/receiver/positioning/fusion/dead_reckoning_options.hpp"

#include <limits>

#include "canyon/base/options/values.hpp"

namespace canyon::positioning {

void visit(options::Visitor& v, DeadReckoningOptions& o) {
  v.boolean({"enabled", "", "go on by the vehicle's inertial sensor and wheels (sensors)"}, o.enabled);
  v.boolean({"non_holonomic", "",
             "the vehicle moves along its own axis, as a car does: no speed sideways or upwards"},
            o.non_holonomic);
  v.number({"sideways_mps", "m/s", "standard deviation of the speed sideways"}, o.sideways_mps,
           {0, 10, true});
  v.number({"upwards_mps", "m/s", "standard deviation of the speed along the vehicle's up axis"},
           o.upwards_mps, {0, 10, true});
  v.number({"alignment_speed_mps", "m/s", "the heading begins with the course at this speed"},
           o.alignment_speed_mps, {0, 100, true});
  v.number(
      {"gate_sigmas", "",
       "fixes and velocities beyond this number of standard deviations are rejected; none: all are used"},
      o.gate_sigmas, options::or_none({0, std::numeric_limits<double>::infinity(), true}));
  v.number({"error_distance_m", "m",
            "horizontal errors of fixes are taken to last until the antenna has moved so far"},
           o.error_distance_m, {0, 1e5, true});
  v.number({"error_height_distance_m", "m", "the same, of heights"}, o.error_height_distance_m,
           {0, 1e5, true});
  v.number({"error_time_s", "s", "errors of fixes are taken to last so long at rest"}, o.error_time_s,
           {0, 3600, true});
  v.number(
      {"space_sigma_m", "m",
       "errors from space, which do not average out: standard deviation of a range, in the stated accuracy"},
      o.space_sigma_m, {0, 100});
  v.number({"astray_s", "s", "after this time with rejected fixes alone the filter doubts its position"},
           o.astray_s, {0, 3600, true});
  v.number({"max_sigma_m", "m", "largest standard deviation of a valid position"}, o.max_sigma_m,
           options::or_none({0, std::numeric_limits<double>::infinity(), true}));
}

}  // namespace canyon::positioning
