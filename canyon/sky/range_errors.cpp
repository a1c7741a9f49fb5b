#include "canyon/sky/range_errors.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "canyon/base/arithmetic.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::sky {

namespace {

using geodesy::kPi;

double polynomial(const std::array<double, 4>& c, double x) {
  return c[0] + x * (c[1] + x * (c[2] + x * c[3]));
}

/// Converts a delay that a model gives for its own frequency to another carrier.
double delay_on_m(double delay_s, double model_hz, double frequency_hz) {
  const double ratio = model_hz / frequency_hz;
  return geodesy::kSpeedOfLight * delay_s * ratio * ratio;
}

using geodesy::GpsTime;

/// Ratios of along-track and cross-track errors to the range error; assumed.
constexpr double kAlong = 2, kCross = 1;
/// The thin-shell model of the ionosphere, of IS-GPS-200 and IONEX [m from the Earth's centre].
constexpr double kShell_m = 6371e3 + 350e3;
/// Medium-scale travelling ionospheric disturbances: vertical delay at 1575.42 MHz, of 0.3 TECU; assumed
/// within the usual 0.1 to 1 TECU, 100 to 300 km and 10 to 60 min.
constexpr double kTravelling_m = 0.05, kTravellingTime_s = 600, kTravellingLength_m = 4e4;

/// Replaces rotations[k] by cos(2 pi rotations[k]), within 1e-13 below 1e9, plus the input's rounding.
CANYON_CLONES void take_cosines(double* __restrict rotations, std::size_t count) {
  constexpr double kWhole = 6755399441055744;  // 1.5 * 2^52: adding it rounds to a whole number
  for (std::size_t k = 0; k < count; ++k) {
    const double part = rotations[k] - ((rotations[k] + kWhole) - kWhole);
    // cos(2 pi part) = sin(2 pi (1/4 - |part|)), by its series.
    const double a = 2 * geodesy::kPi * (0.25 - (part < 0 ? -part : part)), y = a * a;
    double series = 1 - y / (18 * 19);
    series = 1 - y / (16 * 17) * series;
    series = 1 - y / (14 * 15) * series;
    series = 1 - y / (12 * 13) * series;
    series = 1 - y / (10 * 11) * series;
    series = 1 - y / (8 * 9) * series;
    series = 1 - y / (6 * 7) * series;
    series = 1 - y / (4 * 5) * series;
    series = 1 - y / (2 * 3) * series;
    rotations[k] = a * series;
  }
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
  const double low = 0.53 - elevation, obliquity = 1 + 16 * low * low * low;
  const double amplitude = std::max(0.0, polynomial(model.alpha, geomagnetic));
  const double period = std::max(72'000.0, polynomial(model.beta, geomagnetic));
  const double x = 2 * kPi * (local_time - 50'400) / period;
  double delay_s = 5e-9;
  if (std::abs(x) < 1.57) delay_s += amplitude * (1 - x * x / 2 + x * x * x * x / 24);

  return delay_on_m(obliquity * delay_s, gnss::kL1_hz, frequency_hz);
}

double klobuchar_delay_m(const SystemKlobuchar& system_entry, geodesy::GpsTime t,
                         const geodesy::Geodetic& receiver, double azimuth_rad, double elevation_rad,
                         double frequency_hz) {
  const auto& [system, model] = system_entry;
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
  // All satellites of an epoch use one position.
  struct Last {
    double latitude_rad = 0, height_m = 0, humidity = 0, zenith_m = 0;
  };
  static thread_local Last last;
  if (last.zenith_m > 0 && last.latitude_rad == receiver.latitude_rad && last.height_m == receiver.height_m &&
      last.humidity == relative_humidity)
    return last.zenith_m;
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
  last = {receiver.latitude_rad, receiver.height_m, relative_humidity, hydrostatic + wet};
  return last.zenith_m;
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

void RangeErrorOptions::validate() const {
  options::check(*this, "errors");
  for (const auto& [group, sigma_m] : orbit_clock_m) gnss::check_group(group);
}

void visit(options::Visitor& v, RangeErrorOptions& o) {
  options::visit_switch(
      v,
      {"enabled", "",
       "range errors of broadcast orbits, clocks and atmosphere models, common to all receivers",
       "true with nominal satellites, navigation files or corrections"},
      o.enabled);
  gnss::visit_group_values(v, {"orbit_clock_m", "m", "rms range error of broadcast orbits and clocks"},
                           o.orbit_clock_m, {0, 1e4});
  v.number({"orbit_clock_time_s", "s", "time constant of these errors"}, o.orbit_clock_time_s, {60, 1e6});
  v.number(
      {"ionosphere_fraction", "", "rms error of the broadcast model's delay, as a fraction of this delay"},
      o.ionosphere_fraction, {0, 2});
  v.former_name("ionosphere_share", "ionosphere_fraction");
  v.number({"ionosphere_time_s", "s", "time constant of this error"}, o.ionosphere_time_s, {60, 1e6});
  v.number({"ionosphere_length_m", "m", "correlation length of this error"}, o.ionosphere_length_m,
           {1e3, 1e8});
  v.number({"solar_flux_sfu", "sfu",
            "solar flux at 10.7 cm, for the ionosphere of skies without their own coefficients",
            "nominal satellites: 100; else the mean of the date's year"},
           o.solar_flux_sfu, {50, 400});
  v.number({"troposphere_m", "m", "rms error of the standard atmosphere's zenith delay"}, o.troposphere_m,
           {0, 1});
  v.number({"troposphere_time_s", "s", "time constant of this error"}, o.troposphere_time_s, {60, 1e6});
  v.number({"troposphere_length_m", "m", "correlation length of this error"}, o.troposphere_length_m,
           {1e3, 1e8});
}

RangeErrorModel::RangeErrorModel(const RangeErrorOptions& options, std::uint64_t seed,
                                 std::span<const gnss::SatelliteId> satellites,
                                 const std::map<gnss::System, gnss::Klobuchar>& klobuchar)
    : options_(options),
      ionosphere_(RandomStream(seed, "space/ionosphere"), options.ionosphere_time_s,
                  options.ionosphere_length_m),
      travelling_(RandomStream(seed, "space/travelling"), kTravellingTime_s, kTravellingLength_m),
      troposphere_(RandomStream(seed, "space/troposphere"), options.troposphere_time_s,
                   options.troposphere_length_m) {
  options.validate();
  constexpr double kEverywhere = std::numeric_limits<double>::infinity();
  for (const gnss::SatelliteId id : satellites) {
    const auto waves = [&](const char* what) {
      return RandomWaves(RandomStream(seed, "space/" + gnss::to_string(id) + what),
                         options.orbit_clock_time_s, kEverywhere);
    };
    const auto& first = gnss::signals_of(id.system).front();
    satellites_.emplace(id, OfSatellite{gnss::sum_of(options.orbit_clock_m, id, first, GpsTime()),
                                        waves("/range"), waves("/along"), waves("/cross")});
  }
  if (klobuchar.empty()) return;
  const auto gps_entry = klobuchar.find(gnss::System::GPS);
  klobuchar_.insert(gps_entry != klobuchar.end() ? *gps_entry : *klobuchar.begin());
}

RangeErrorModel RangeErrorModel::sampled_by(std::uint64_t seed,
                                            std::span<const gnss::SatelliteId> satellites) const {
  return {options_, seed, satellites, klobuchar_};
}

double RangeErrorModel::orbit_clock_m(const orbit::LineOfSight& line, GpsTime reception) const {
  const auto found = satellites_.find(line.id);
  if (found == satellites_.end() || found->second.range_m == 0) return 0;
  const OfSatellite& satellite = found->second;
  const Eigen::Vector3d& position = line.position_at_reception_m;
  // The direction of motion in inertial axes.
  const Eigen::Vector3d rotation_rate(0, 0, geodesy::kEarthRotationRate);
  const Eigen::Vector3d velocity = line.velocity_at_reception_mps + rotation_rate.cross(position);
  const Eigen::Vector3d cross = position.cross(velocity).normalized();
  const Eigen::Vector3d along = cross.cross(position).normalized();
  // Linear over a thousandth of the time constant: within 2e-7 of the waves.
  const double step_s = options_.orbit_clock_time_s / 1000, steps = (reception - GpsTime()) / step_s;
  const double begin = std::floor(steps);
  using Ends = std::array<Eigen::Vector3d, 2>;  // range, along, cross
  const auto& ends =
      thread_cached<Ends>(number_, gnss::dense_index(line.id), static_cast<std::int64_t>(begin), [&] {
        const auto at = [&](double step) {
          const auto value = [t = GpsTime() + step * step_s](const RandomWaves& waves) {
            return waves.at(t, Eigen::Vector3d::Zero());
          };
          return Eigen::Vector3d(value(satellite.range), kAlong * value(satellite.along),
                                 kCross * value(satellite.cross));
        };
        return Ends{at(begin), at(begin + 1)};
      });
  const Eigen::Vector3d error = ends[0] + (steps - begin) * (ends[1] - ends[0]);
  return satellite.range_m *
         error.dot(Eigen::Vector3d(1, along.dot(line.direction_ecef), cross.dot(line.direction_ecef)));
}

double RangeErrorModel::ionosphere_m(const orbit::LineOfSight& line, const Reception& reception) const {
  if (klobuchar_.empty()) return 0;
  const double model_m = klobuchar_delay_m(*klobuchar_.begin(), reception.time, reception.position,
                                           line.azimuth_rad, line.elevation_rad, gnss::kL1_hz);
  // |receiver + s direction| = shell.
  const Eigen::Vector3d& receiver = reception.receiver_ecef;
  const double up = receiver.dot(line.direction_ecef);
  const double s = -up + std::sqrt(up * up + kShell_m * kShell_m - receiver.squaredNorm());
  const Eigen::Vector3d pierced = receiver + s * line.direction_ecef;
  const double slant = kShell_m / pierced.dot(line.direction_ecef);  // 1 / cos of the angle there
  const double delay_m =
      model_m * (1 + options_.ionosphere_fraction * ionosphere_.at(reception.time, pierced)) +
      slant * kTravelling_m * travelling_.at(reception.time, pierced);
  return std::max(0.0, delay_m);
}

RangeErrorModel::Reception RangeErrorModel::reception(GpsTime time,
                                                      const Eigen::Vector3d& receiver_ecef) const {
  Reception result{time, receiver_ecef, geodesy::geodetic_from_ecef(receiver_ecef)};
  result.zenith_m =
      saastamoinen_zenith_m(result.position) + options_.troposphere_m * troposphere_.at(time, receiver_ecef);
  return result;
}

RangeErrors RangeErrorModel::at(const orbit::LineOfSight& line, const Reception& reception) const {
  RangeErrors delays;
  delays.orbit_clock_m = orbit_clock_m(line, reception.time);
  delays.ionosphere_m = ionosphere_m(line, reception);
  delays.troposphere_m = slant_delay_m(reception.zenith_m, line.elevation_rad);
  return delays;
}

RandomWaves::RandomWaves(RandomStream stream, double time_s, double length_m) {
  constexpr double kTwoPi = 2 * geodesy::kPi;
  for (std::size_t k = 0; k < frequency_hz_.size(); ++k) {
    frequency_hz_[k] = stream.normal() / time_s / kTwoPi;
    x_per_m_[k] = stream.normal() / length_m / kTwoPi;
    y_per_m_[k] = stream.normal() / length_m / kTwoPi;
    z_per_m_[k] = stream.normal() / length_m / kTwoPi;
    phase_cycles_[k] = stream.uniform();
  }
}

double RandomWaves::at(geodesy::GpsTime time, const Eigen::Vector3d& point) const {
  const double seconds = time - geodesy::GpsTime();
  Waves cosines;
  for (std::size_t k = 0; k < cosines.size(); ++k) {
    cosines[k] = frequency_hz_[k] * seconds +
                 (x_per_m_[k] * point.x() + y_per_m_[k] * point.y() + z_per_m_[k] * point.z()) +
                 phase_cycles_[k];
  }
  take_cosines(cosines.data(), cosines.size());
  std::array<double, 4> sums{};
  for (std::size_t k = 0; k < cosines.size(); ++k) sums[k % sums.size()] += cosines[k];
  return ((sums[0] + sums[1]) + (sums[2] + sums[3])) * std::sqrt(2.0 / static_cast<double>(cosines.size()));
}

const SystemKlobuchar& klobuchar_of(const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
                                    gnss::System system) {
  auto found = klobuchar.find(system);
  if (found == klobuchar.end()) found = klobuchar.find(gnss::System::GPS);
  if (found == klobuchar.end()) {
    throw InputError(
        fmt::format("there are no Klobuchar coefficients for {} or GPS", gnss::name(system)),
        "give a navigation file with them in its header (GPSA and GPSB), or disable the ionosphere");
  }
  return *found;
}

double atmosphere_m(bool ionosphere, bool troposphere,
                    const std::map<gnss::System, gnss::Klobuchar>& klobuchar, gnss::System system,
                    double carrier_frequency_hz, geodesy::GpsTime time, const geodesy::Geodetic& position,
                    const geodesy::AzimuthElevation& look_angles) {
  double delay_m = 0;
  if (ionosphere) {
    delay_m += klobuchar_delay_m(klobuchar_of(klobuchar, system), time, position, look_angles.azimuth_rad,
                                 look_angles.elevation_rad, carrier_frequency_hz);
  }
  if (troposphere) delay_m += saastamoinen_delay_m(position, look_angles.elevation_rad);
  return delay_m;
}

}  // namespace canyon::sky
