#include "canyon/errors/atmosphere.hpp"

#include <algorithm>
#include <cmath>

#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/gnss/signals.hpp"

namespace canyon::errors {
namespace {

using geodesy::kPi;

double polynomial(const std::array<double, 4>& c, double x) {
  return c[0] + x * (c[1] + x * (c[2] + x * c[3]));
}

/// A delay on a carrier, which a model gives on its own.
double delay_on_m(double delay_s, double model_hz, double frequency_hz) {
  const double ratio = model_hz / frequency_hz;
  return geodesy::kSpeedOfLight * delay_s * ratio * ratio;
}

}  // namespace

// IS-GPS-200, figure 20-4. Angles there are semicircles.
double klobuchar_delay_m(const gnss::Klobuchar& model, geodesy::GpsTime t, const geodesy::Geodetic& receiver,
                         double azimuth_rad, double elevation_rad, double frequency_hz) {
  if (elevation_rad <= 0) return 0;
  const double elevation = elevation_rad / kPi;
  const double earth_angle = 0.0137 / (elevation + 0.11) - 0.022;
  const double latitude =
      std::clamp(receiver.latitude_rad / kPi + earth_angle * std::cos(azimuth_rad), -0.416, 0.416);
  const double longitude =
      receiver.longitude_rad / kPi + earth_angle * std::sin(azimuth_rad) / std::cos(latitude * kPi);
  const double geomagnetic = latitude + 0.064 * std::cos((longitude - 1.617) * kPi);

  const double seconds = 43'200 * longitude + t.seconds_of_week();
  const double local_time = seconds - std::floor(seconds / 86'400) * 86'400;
  const double obliquity = 1 + 16 * std::pow(0.53 - elevation, 3);
  const double amplitude = std::max(0.0, polynomial(model.alpha, geomagnetic));
  const double period = std::max(72'000.0, polynomial(model.beta, geomagnetic));
  const double x = 2 * kPi * (local_time - 50'400) / period;
  double delay_s = 5e-9;
  if (std::abs(x) < 1.57) delay_s += amplitude * (1 - x * x / 2 + x * x * x * x / 24);

  return delay_on_m(obliquity * delay_s, gnss::kL1_hz, frequency_hz);
}

double klobuchar_delay_m(const SystemKlobuchar& of_system, geodesy::GpsTime t,
                         const geodesy::Geodetic& receiver, double azimuth_rad, double elevation_rad,
                         double frequency_hz) {
  const auto& [system, model] = of_system;
  if (system != gnss::System::BeiDou)
    return klobuchar_delay_m(model, t, receiver, azimuth_rad, elevation_rad, frequency_hz);
  if (elevation_rad <= 0) return 0;
  constexpr double kShell = 6378.0 / (6378 + 375);
  const double sine = kShell * std::cos(elevation_rad);  // of the zenith angle at the shell
  const double earth_angle = kPi / 2 - elevation_rad - std::asin(sine);
  const double latitude =
      std::asin(std::sin(receiver.latitude_rad) * std::cos(earth_angle) +
                std::cos(receiver.latitude_rad) * std::sin(earth_angle) * std::cos(azimuth_rad));
  const double longitude =
      receiver.longitude_rad + std::asin(std::sin(earth_angle) * std::sin(azimuth_rad) / std::cos(latitude));

  const double seconds = 43'200 * longitude / kPi + t.seconds_of_week() - geodesy::kBdtSecondsOffset;
  const double from_noon = seconds - std::floor(seconds / 86'400) * 86'400 - 50'400;
  const double amplitude = std::max(0.0, polynomial(model.alpha, std::abs(latitude / kPi)));
  const double period = std::clamp(polynomial(model.beta, std::abs(latitude / kPi)), 72'000.0, 172'800.0);
  double delay_s = 5e-9;
  if (std::abs(from_noon) < period / 4) delay_s += amplitude * std::cos(2 * kPi * from_noon / period);
  return delay_on_m(delay_s / std::sqrt(1 - sine * sine), gnss::l1_frequency_hz(gnss::System::BeiDou),
                    frequency_hz);
}

// Saastamoinen (1972) with the refinements of Davis et al. (1985) in the hydrostatic part; standard
// atmosphere of 15 deg C and 1013.25 hPa at sea level, isothermal above 11 km (ICAO Doc 7488). Below sea
// level and above 100 km, gravity and weather are those of these heights.
double saastamoinen_zenith_m(const geodesy::Geodetic& receiver, double relative_humidity) {
  constexpr double kTropopause_m = 11e3, kScaleHeight_m = 6341.6, kHighest_m = 100e3;
  const double height = std::clamp(receiver.height_m, 0.0, kHighest_m);
  const double below = std::min(height, kTropopause_m);
  const double thinner = height > kTropopause_m ? std::exp((kTropopause_m - height) / kScaleHeight_m) : 1;
  const double pressure_hpa = 1013.25 * std::pow(1 - 2.2557e-5 * below, 5.2568) * thinner;
  const double temperature_k = 15 - 6.5e-3 * below + 273.16;
  const double vapour_hpa = 6.108 * relative_humidity *
                            std::exp((17.15 * temperature_k - 4684) / (temperature_k - 38.45)) * thinner;
  const double gravity = 1 - 0.00266 * std::cos(2 * receiver.latitude_rad) - 0.00028 * height / 1e3;
  const double hydrostatic = 0.0022768 * pressure_hpa / gravity;
  const double wet = 0.002277 * (1255 / temperature_k + 0.05) * vapour_hpa;
  return hydrostatic + wet;
}

double saastamoinen_delay_m(const geodesy::Geodetic& receiver, double elevation_rad,
                            double relative_humidity) {
  return slant_delay_m(saastamoinen_zenith_m(receiver, relative_humidity), elevation_rad);
}

// RTCA DO-229D, A.4.2.4, with its extension below 4 deg.
double slant_delay_m(double zenith_m, double elevation_rad) {
  if (elevation_rad <= 0) return 0;
  const double sine = std::sin(elevation_rad), low_deg = 4 - geodesy::degrees(elevation_rad);
  const double mapping = 1.001 / std::sqrt(0.002001 + sine * sine);
  return zenith_m * mapping * (low_deg > 0 ? 1 + 0.015 * low_deg * low_deg : 1);
}

}  // namespace canyon::errors
