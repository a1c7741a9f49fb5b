#include "canyon/simulation/inertial/sensors.hpp"

#include <algorithm>
#include <cmath>

#include "canyon/base/options/values.hpp"

namespace canyon::inertial {

namespace {

// ICAO Doc 7488.
constexpr double kGravity_mps2 = 9.80665;
constexpr double kGasConstant = 287.05287;  ///< of dry air [J/(kg K)]
constexpr double kEarthRadius_m = 6356766;  ///< of the geopotential height
constexpr double kSeaLevel_pa = 101325, kSeaLevel_k = 288.15;

/// Assumed: time constant of a barometer's slow error; final warming of its sensor over the air, and its time
/// constant; correlation distance of the field of steel along the road.
constexpr double kDriftTime_s = 600, kWarming_k = 10, kWarmingTime_s = 300, kSurroundings_m = 10;

struct Layer {
  double base_m;  ///< geopotential
  double gradient_kpm;
};
constexpr std::array kLayers{Layer{0, -0.0065}, Layer{11000, 0}, Layer{20000, 0.001}, Layer{32000, 0.0028}};
constexpr double kLowest_m = -1000, kHighest_m = 47000;

/// Pressure at the upper end of a vertical path through a layer, over that at its lower end.
double ratio(double from_k, double gradient_kpm, double travelled_m) {
  if (gradient_kpm == 0) return std::exp(-kGravity_mps2 * travelled_m / (kGasConstant * from_k));
  return std::pow(1 + gradient_kpm * travelled_m / from_k, -kGravity_mps2 / (kGasConstant * gradient_kpm));
}

}  // namespace

double Air::density_kgpm3() const {
  return pressure_pa / (kGasConstant * temperature_k);
}

Air air_at(double height_m, double sea_level_pressure_pa, double sea_level_temperature_k) {
  const double h = std::clamp(height_m, kLowest_m, kHighest_m);
  const double geopotential_m = kEarthRadius_m * h / (kEarthRadius_m + h);
  Air air{sea_level_pressure_pa, sea_level_temperature_k};
  for (std::size_t i = 0; i < kLayers.size(); ++i) {
    const Layer& layer = kLayers[i];
    const bool last = i + 1 == kLayers.size() || geopotential_m <= kLayers[i + 1].base_m;
    const double travelled_m = (last ? geopotential_m : kLayers[i + 1].base_m) - layer.base_m;
    air.pressure_pa *= ratio(air.temperature_k, layer.gradient_kpm, travelled_m);
    air.temperature_k += layer.gradient_kpm * travelled_m;
    if (last) break;
  }
  return air;
}

double pressure_altitude_m(double pressure_pa) {
  double base_pa = kSeaLevel_pa, base_k = kSeaLevel_k, geopotential_m = 0;
  for (std::size_t i = 0; i < kLayers.size(); ++i) {
    const Layer& layer = kLayers[i];
    const double travelled_m = i + 1 < kLayers.size() ? kLayers[i + 1].base_m - layer.base_m : 0;
    const double top_pa = base_pa * ratio(base_k, layer.gradient_kpm, travelled_m);
    if (i + 1 == kLayers.size() || pressure_pa >= top_pa) {
      const double scale = kGasConstant / kGravity_mps2;
      geopotential_m =
          layer.base_m + (layer.gradient_kpm == 0
                              ? -scale * base_k * std::log(pressure_pa / base_pa)
                              : base_k / layer.gradient_kpm *
                                    (std::pow(pressure_pa / base_pa, -scale * layer.gradient_kpm) - 1));
      break;
    }
    base_pa = top_pa;
    base_k += layer.gradient_kpm * travelled_m;
  }
  return kEarthRadius_m * geopotential_m / (kEarthRadius_m - geopotential_m);
}

Barometer::Barometer(const BarometerOptions& options, std::uint64_t seed)
    : options_(options),
      numbers_(barometer_numbers(options)),
      random_(seed, "barometer"),
      turn_on_pa_(numbers_.turn_on_pa * random_.normal()),
      drift_pa_(numbers_.drift_pa * random_.normal()),
      per_kelvin_pa_(numbers_.temperature_pa_k * random_.normal()) {
  options::check(options, "barometer");
}

Air Barometer::air(double height_m, double t_s) const {
  constexpr double kHour_s = 3600;
  return air_at(height_m, options_.sea_level_pressure_pa + options_.pressure_change_pa_h * t_s / kHour_s,
                options_.sea_level_temperature_c + kZeroCelsius_k);
}

Pressure Barometer::measure(double height_m, double speed_mps, double t_s) {
  const Air air = this->air(height_m, t_s);
  const double sensor_k = air.temperature_k + warming_k(kWarming_k, kWarmingTime_s, t_s);
  const double keep = std::exp(-1 / (options_.rate_hz * kDriftTime_s));
  drift_pa_ = keep * drift_pa_ + numbers_.drift_pa * std::sqrt(1 - keep * keep) * random_.normal();
  const double dynamic_pa = 0.5 * air.density_kgpm3() * speed_mps * speed_mps;
  double measured_pa = air.pressure_pa + options_.airflow * dynamic_pa + turn_on_pa_ + drift_pa_ +
                       per_kelvin_pa_ * (sensor_k - kCalibrated_k) + numbers_.noise_pa * random_.normal();
  if (numbers_.resolution_pa > 0)
    measured_pa = std::round(measured_pa / numbers_.resolution_pa) * numbers_.resolution_pa;
  return {measured_pa, air.pressure_pa, air.temperature_k, sensor_k};
}

Magnetometer::Magnetometer(const MagnetometerOptions& options, std::uint64_t seed)
    : options_(options),
      random_(seed, "magnetometer"),
      steel_random_(seed, "magnetometer/surroundings"),
      triad_(magnetometer_numbers(options), random_),
      steel_enu_t_(options.surroundings_ut * 1e-6 * three_normals(steel_random_)) {
  options::check(options, "magnetometer");
}

Eigen::Vector3d Magnetometer::measure(const Eigen::Vector3d& field_enu_t,
                                      const Eigen::Matrix3d& enu_from_sensor, double travelled_m) {
  if (options_.surroundings_ut > 0 && travelled_m > 0) {
    const double keep = std::exp(-travelled_m / kSurroundings_m);
    steel_enu_t_ = keep * steel_enu_t_ + options_.surroundings_ut * 1e-6 * std::sqrt(1 - keep * keep) *
                                             three_normals(steel_random_);
  }
  const Eigen::Vector3d felt = enu_from_sensor.transpose() * (field_enu_t + steel_enu_t_);
  return triad_.measure(felt, Eigen::Vector3d::Zero(), 1 / options_.rate_hz, random_);
}

Wheels::Wheels(const WheelOptions& options, std::uint64_t seed) : options_(options), random_(seed, "wheels") {
  options::check(options, "wheels");
  for (Wheel& wheel : wheels_) {
    wheel.scale = options.scale * random_.normal();
    wheel.slip = options.slip * random_.normal();
  }
}

WheelSample Wheels::measure(const WheelPair& travelled_m, double dt_s) {
  WheelSample sample;
  const double keep = std::exp(-dt_s / options_.slip_time_s);
  if (options_.tick_m > 0) sample.ticks.emplace();
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    Wheel& wheel = wheels_[i];
    wheel.slip = keep * wheel.slip + options_.slip * std::sqrt(1 - keep * keep) * random_.normal();
    double felt_m = travelled_m[i] * (1 + wheel.scale + wheel.slip);
    if (!options_.direction) felt_m = std::abs(felt_m);
    wheel.counted_m += felt_m;
    double reported_m = wheel.counted_m;
    if (sample.ticks) {
      const double ticks = std::floor(wheel.counted_m / options_.tick_m);
      (*sample.ticks)[i] = static_cast<std::int64_t>(ticks);
      reported_m = ticks * options_.tick_m;
    }
    sample.speed_mps[i] = (reported_m - wheel.reported_m) / dt_s;
    wheel.reported_m = reported_m;
  }
  return sample;
}

}  // namespace canyon::inertial
