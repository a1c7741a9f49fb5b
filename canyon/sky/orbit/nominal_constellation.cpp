#include "canyon/sky/orbit/nominal_constellation.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"

namespace canyon::orbit {
namespace {

using geodesy::GpsTime;
using std::chrono::seconds;
using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr double kMaxSpan_s = 60 * 86'400.0;

// The user algorithms' own constants: the records must fit the code that reads them.
constexpr double kMuGps = 3.986005e14;           // IS-GPS-200, 20.3.3.4.3.3
constexpr double kMuOthers = geodesy::kEarthMu;  // Galileo OS-SIS-ICD 5.1.1; BDS-SIS-ICD B1I 5.2.4.12
constexpr double kGeoTilt_rad = geodesy::radians(5);

/// `start + rate * t` wrapped to [-pi, pi]. Long double: decades of orbits are 2e5 rad, where a double's
/// rounding alone is a millimetre on the orbit.
double advance(double start, long double rate, GpsTime from, GpsTime to) {
  const long double t = static_cast<long double>(to.nanoseconds() - from.nanoseconds()) * 1e-9L;
  return static_cast<double>(
      std::remainder(static_cast<long double>(start) + rate * t, 2 * 3.141592653589793238463L));
}

double wrap(double angle) {
  return std::remainder(angle, 2 * geodesy::kPi);
}

/// Spacing and grid of the records of a Kepler system.
struct Issue {
  int spacing_s = 7200;
  GpsTime grid;  ///< an instant of the system's grid
  double accuracy_m = 2;
};

Issue issue_of(gnss::System system) {
  if (system == gnss::System::GPS) return {7200, GpsTime(), 2.0};
  if (system == gnss::System::Galileo) return {3600, GpsTime(), 3.12};
  return {3600, geodesy::gps_from_bdt(0, 0), 2.0};
}

/// Last grid instant at or before `t`.
GpsTime floor_to(const Issue& issue, GpsTime t) {
  const std::int64_t spacing = issue.spacing_s * GpsTime::kNanosecondsPerSecond;
  const std::int64_t offset = t.nanoseconds() - issue.grid.nanoseconds();
  std::int64_t remainder = offset % spacing;
  if (remainder < 0) remainder += spacing;
  return GpsTime::from_nanoseconds(t.nanoseconds() - remainder);
}

gnss::KeplerEphemeris kepler_record(const Slot& slot, const Issue& issue, GpsTime toe) {
  const gnss::System system = slot.id.system;
  gnss::KeplerEphemeris e;
  e.id = slot.id;
  e.toc = e.toe = toe;
  e.transmission = toe - seconds(issue.spacing_s);
  e.accuracy_m = issue.accuracy_m;
  e.sqrt_a = std::sqrt(slot.semi_major_axis_m);

  const double mu = system == gnss::System::GPS ? kMuGps : kMuOthers;
  const bool beidou = system == gnss::System::BeiDou;
  const double second_of_week = (beidou ? toe - seconds(geodesy::kBdtSecondsOffset) : toe).seconds_of_week();
  double node = 0;
  double rate = 0;
  if (slot.geostationary) {
    // BDS-SIS-ICD B1I 5.2.4.12: GEO elements refer to a plane tilted by 5 deg. The equator lies in it with
    // its ascending node on -x of the Earth at toe, at -x again after the ICD's rotation.
    e.inclination = kGeoTilt_rad;
    node = geodesy::kPi;
    e.mean_anomaly = wrap(slot.node_longitude_rad - geodesy::kPi);
    rate = slot.earth_rate;
  } else {
    e.inclination = slot.inclination_rad;
    e.right_ascension_rate = slot.node_rate;
    node = advance(slot.node_longitude_rad,
                   static_cast<long double>(slot.node_rate) - static_cast<long double>(slot.earth_rate),
                   slot.epoch, toe);
    e.mean_anomaly = advance(slot.argument_of_latitude_rad, slot.argument_of_latitude_rate, slot.epoch, toe);
    rate = slot.argument_of_latitude_rate;
  }
  e.right_ascension = wrap(node + slot.earth_rate * second_of_week);
  const double a = e.sqrt_a * e.sqrt_a;
  e.mean_motion_difference = rate - std::sqrt(mu / (a * a * a));

  // Issues count records, so that each differs from its neighbours.
  const auto count = static_cast<int>(second_of_week / issue.spacing_s);
  switch (system) {
    case gnss::System::GPS:
      e.iode = e.iodc = count;
      e.fit_interval_h = 4;
      e.data_sources = 1;
      break;
    case gnss::System::Galileo:
      e.iode = count;
      e.data_sources = 1 << 0 | 1 << 2 | 1 << 9;  // I/NAV on E1-B and E5b, clock for E5b/E1
      break;
    default:
      e.iode = e.iodc = 1;  // AODE, AODC: younger than an hour
      break;
  }
  return e;
}

using geodesy::kPz90J2;
using geodesy::kPz90Mu;
using geodesy::kPz90SemiMajorAxis;

/// Two-body and J2 motion in a frame that does not rotate; rows position, velocity.
Vector6d inertial_rate(const Vector6d& state) {
  const Eigen::Vector3d p = state.head<3>();
  const double r2 = p.squaredNorm();
  const double g = kPz90Mu / (r2 * std::sqrt(r2));
  const double k = 1.5 * kPz90J2 * kPz90SemiMajorAxis * kPz90SemiMajorAxis / r2;
  const double z2 = 5 * p.z() * p.z() / r2;
  Vector6d rate;
  rate << state.tail<3>(), -g * p.x() * (1 + k * (1 - z2)), -g * p.y() * (1 + k * (1 - z2)),
      -g * p.z() * (1 + k * (3 - z2));
  return rate;
}

Vector6d integrate(Vector6d state, double duration_s) {
  const int steps = static_cast<int>(std::ceil(duration_s / 60));
  const double h = duration_s / steps;
  for (int i = 0; i < steps; ++i) {
    const Vector6d k1 = inertial_rate(state);
    const Vector6d k2 = inertial_rate(state + h / 2 * k1);
    const Vector6d k3 = inertial_rate(state + h / 2 * k2);
    const Vector6d k4 = inertial_rate(state + h * k3);
    state += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return state;
}

double argument_of_latitude(const Vector6d& state) {
  const Eigen::Vector3d p = state.head<3>();
  const Eigen::Vector3d h = p.cross(state.tail<3>()).normalized();
  const Eigen::Vector3d node = Eigen::Vector3d::UnitZ().cross(h).normalized();
  return std::atan2(p.dot(h.cross(node)), p.dot(node));
}

/// Semi-major axis whose mean argument of latitude moves at `rate` under J2 (e = 0: n (1 + 3/2 J2 (R/a)^2
/// (3 - 4 sin^2 i)); Vallado, eqs. 9-37, 9-39, 9-41).
double circular_axis(double rate, double inclination) {
  const double s = std::sin(inclination);
  double a = std::cbrt(kPz90Mu / (rate * rate));
  for (int i = 0; i < 5; ++i) {
    const double q = kPz90SemiMajorAxis / a;
    const double n = rate / (1 + 1.5 * kPz90J2 * q * q * (3 - 4 * s * s));
    a = std::cbrt(kPz90Mu / (n * n));
  }
  return a;
}

/// State in the ECEF axes of `t` on the near-circular J2 orbit that passes the slot at `t` and comes back to
/// the same argument of latitude after exactly the slot's draconic period.
gnss::GlonassEphemeris glonass_start(const Slot& slot, GpsTime t) {
  const double node = advance(slot.node_longitude_rad,
                              static_cast<long double>(slot.node_rate) - slot.earth_rate, slot.epoch, t);
  const double u = advance(slot.argument_of_latitude_rad, slot.argument_of_latitude_rate, slot.epoch, t);
  const Eigen::Matrix3d orbit = (Eigen::AngleAxisd(node, Eigen::Vector3d::UnitZ()) *
                                 Eigen::AngleAxisd(slot.inclination_rad, Eigen::Vector3d::UnitX()) *
                                 Eigen::AngleAxisd(u, Eigen::Vector3d::UnitZ()))
                                    .toRotationMatrix();
  const double period = 2 * geodesy::kPi / slot.argument_of_latitude_rate;
  const double a = circular_axis(slot.argument_of_latitude_rate, slot.inclination_rad);
  double speed = a * slot.argument_of_latitude_rate;
  Vector6d state;
  // Faster means a longer period, by 3 dv/v: 6 pi dv/v behind after a revolution. Three rounds reach 1e-12.
  for (int i = 0; i < 5; ++i) {
    state << orbit.col(0) * a, orbit.col(1) * speed;
    const double ahead = wrap(argument_of_latitude(integrate(state, period)) - u);
    speed *= 1 + ahead / (6 * geodesy::kPi);
  }
  state << orbit.col(0) * a, orbit.col(1) * speed;

  const Eigen::Vector3d position = state.head<3>();
  const Eigen::Vector3d velocity =
      state.tail<3>() - Eigen::Vector3d(0, 0, geodesy::kPz90RotationRate).cross(position);
  gnss::GlonassEphemeris e;
  e.id = slot.id;
  e.toe = e.transmission = t;
  e.channel = slot.glonass_channel;
  for (std::size_t i = 0; i < 3; ++i) {
    e.position_m[i] = position[static_cast<Eigen::Index>(i)];
    e.velocity_mps[i] = velocity[static_cast<Eigen::Index>(i)];
  }
  return e;
}

/// 00:00 UTC of the day of `t`, `days` days later.
GpsTime utc_midnight(GpsTime t, int days) {
  geodesy::CalendarTime day = geodesy::utc_from_gps(t);
  day.hour = day.minute = day.second = 0;
  day.nanosecond = 0;
  const GpsTime linear = geodesy::gps_from_calendar(day) + std::chrono::hours(24 * days);
  return geodesy::gps_from_utc(geodesy::calendar_from_gps(linear));
}

void add_glonass(GpsTime begin, GpsTime end, gnss::NavigationData& data) {
  // tb lies in the middle of each half hour of Moscow time, hence of UTC (ICD 4.4).
  constexpr int kSpacing_s = 1800;
  for (const Slot& slot : nominal_slots(gnss::System::GLONASS)) {
    gnss::GlonassEphemeris e = glonass_start(slot, utc_midnight(begin, 0));
    for (int record = 0;; ++record) {
      const GpsTime tb =
          utc_midnight(begin, record / 48) + seconds(kSpacing_s / 2 + kSpacing_s * (record % 48));
      const SatelliteState state = propagate(e, tb);
      e.toe = tb;
      e.transmission = tb - seconds(kSpacing_s / 2);
      for (std::size_t i = 0; i < 3; ++i) {
        e.position_m[i] = state.position_m[static_cast<Eigen::Index>(i)];
        e.velocity_mps[i] = state.velocity_mps[static_cast<Eigen::Index>(i)];
      }
      // A record serves the half hours on both sides of it.
      if (tb + seconds(kSpacing_s) > begin) data.glonass.push_back(e);
      if (tb >= end) break;
    }
  }
}

void add_kepler(gnss::System system, GpsTime begin, GpsTime end, gnss::NavigationData& data) {
  const Issue issue = issue_of(system);
  for (const Slot& slot : nominal_slots(system)) {
    for (GpsTime toe = floor_to(issue, begin);; toe = toe + seconds(issue.spacing_s)) {
      data.kepler.push_back(kepler_record(slot, issue, toe));
      if (toe >= end) break;
    }
  }
}

}  // namespace

gnss::NavigationData nominal_constellation(GpsTime begin, GpsTime end,
                                           const std::set<gnss::System>& systems) {
  if (end < begin) {
    throw InputError(fmt::format("nominal constellation: the span ends at {} before it begins at {}",
                                 geodesy::format_gpst(end, 0), geodesy::format_gpst(begin, 0)));
  }
  if (end - begin > kMaxSpan_s) {
    throw InputError(
        fmt::format("nominal constellation: a span of {:.1f} days is too long", (end - begin) / 86'400),
        "give at most 60 days");
  }
  gnss::NavigationData data;
  data.sources = {"nominal constellation"};
  data.leap_seconds = geodesy::leap_seconds(begin);
  data.klobuchar[gnss::System::GPS] = standard_ionosphere();
  for (const gnss::System system : systems) {
    if (system == gnss::System::GLONASS) {
      add_glonass(begin, end, data);
    } else {
      add_kepler(system, begin, end, data);
    }
  }
  if (data.empty()) {
    throw InputError("nominal constellation: no system with published slots is chosen",
                     "choose among GPS, GLONASS, Galileo and BeiDou");
  }
  return data;
}

double mean_solar_flux_sfu(GpsTime date) {
  constexpr int kFirst = 1996;
  constexpr std::array<double, 31> kMeans{72, 81, 118, 154, 180, 184, 180, 130, 107, 94, 81,
                                          73, 69, 71,  80,  116, 120, 123, 146, 118, 89, 77,
                                          70, 70, 74,  82,  125, 160, 191, 155, 134};  // 2026 to August
  const auto year = static_cast<std::size_t>(geodesy::calendar_from_gps(date).year - kFirst);
  return year < kMeans.size() ? kMeans[year] : kMediumSolarFlux_sfu;
}

gnss::Klobuchar standard_ionosphere(double solar_flux_sfu) {
  gnss::Klobuchar set{{0.1118e-07, -0.7451e-08, -0.5961e-07, 0.1192e-06},
                      {0.1167e+06, -0.2294e+06, -0.1311e+06, 0.1049e+07}};
  for (double& amplitude : set.alpha) amplitude *= solar_flux_sfu / kMediumSolarFlux_sfu;
  return set;
}

}  // namespace canyon::orbit
