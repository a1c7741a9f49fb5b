#include "canyon/inertial/barometer_options.hpp"

#include "canyon/options/values.hpp"

namespace canyon::inertial {

void BarometerOptions::validate() const {
  options::check(*this, "barometer");
}

void visit(options::Visitor& v, BarometerOptions& o) {
  v.number({"rate_hz", "Hz", "samples"}, o.rate_hz, {0.1, 1000});
  v.section("position", [&] {
    v.number({"forward_m", "m", "barometer ahead of the trajectory's point"}, o.position_m.x(),
             {-1000, 1000});
    v.number({"left_m", "m", "barometer to the left of that point"}, o.position_m.y(), {-1000, 1000});
    v.number({"up_m", "m", "barometer above that point"}, o.position_m.z(), {-1000, 1000});
  });
  v.number({"sea_level_pressure_pa", "Pa", "of the air at mean sea level"}, o.sea_level_pressure_pa,
           {85000, 110000});
  v.number(
      {"sea_level_temperature_c", "deg C", "of the air at mean sea level; it falls by 6.5 K a kilometre"},
      o.sea_level_temperature_c, {-60, 50});
  v.number({"noise_pa", "Pa", "standard deviation of each sample's noise"}, o.noise_pa, {0, 1000});
  v.number({"turn_on_pa", "Pa", "standard deviation of an error that stays for a run"}, o.turn_on_pa,
           {0, 5000});
  v.number({"drift_pa", "Pa", "standard deviation of an error that changes slowly: temperature, weather"},
           o.drift_pa, {0, 5000});
  v.number({"drift_time_s", "s", "time constant of that error"}, o.drift_time_s, {1, 100000});
  v.number({"airflow", "",
            "share of the dynamic pressure of the vehicle's speed that is felt; -1 to 1 by the place of the "
            "opening"},
           o.airflow, {-2, 2});
  v.number({"resolution_pa", "Pa", "step of the reading; 0: none"}, o.resolution_pa, {0, 1000});
}

}  // namespace canyon::inertial
