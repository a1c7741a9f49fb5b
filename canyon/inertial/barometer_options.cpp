#include "canyon/inertial/barometer_options.hpp"

#include <array>
#include <string_view>

#include "canyon/options/values.hpp"

namespace canyon::inertial {
namespace {

// MS5611-01BA03 (TE Connectivity): noise at 4,096 samples of oversampling; accuracy of 150 Pa at 25 deg C,
// taken as two deviations; 250 Pa from -20 to 85 deg C. BMP388 (Bosch, BST-BMP388-DS001): noise and step of
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

void BarometerOptions::validate() const {
  options::check(*this, "barometer");
}

void visit(options::Visitor& v, BarometerOptions& o) {
  static constexpr std::string_view kProfileWords[]{"ideal", "ms5611", "bmp388"};
  static constexpr std::string_view kBy = "by profile";
  v.choice({"profile", "", "part, which gives the defaults of its numbers: ideal, ms5611, bmp388"}, o.profile,
           kProfileWords);
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
  v.number({"turn_on_pa", "Pa", "standard deviation of an error that stays for a run", kBy}, o.turn_on_pa,
           {0, 5000});
  v.number({"drift_pa", "Pa", "standard deviation of an error that changes slowly", kBy}, o.drift_pa,
           {0, 5000});
  v.number({"drift_time_s", "s", "time constant of that error"}, o.drift_time_s, {1, 100000});
  v.number({"temperature_pa_k", "Pa/K",
            "standard deviation of the error for each K of the sensor over 25 deg C", kBy},
           o.temperature_pa_k, {0, 100});
  v.number({"warming_k", "K", "how much warmer than the air the sensor becomes"}, o.warming_k, {-100, 100});
  v.number({"warming_time_s", "s", "time constant of that"}, o.warming_time_s, {1, 100000});
  v.number({"delay_s", "s", "age of the air that a sample states"}, o.delay_s, {0, 10});
  v.number({"airflow", "",
            "share of the dynamic pressure of the vehicle's speed that is felt; -1 to 1 by the place of the "
            "opening"},
           o.airflow, {-2, 2});
  v.number({"resolution_pa", "Pa", "step of the reading; 0: none", kBy}, o.resolution_pa, {0, 1000});
}

}  // namespace canyon::inertial
