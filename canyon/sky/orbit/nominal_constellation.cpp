#include "canyon/sky/orbit/nominal_constellation.hpp"

#include <fmt/format.h>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"

namespace canyon::orbit {
namespace {

using geodesy::GpsTime;
using std::chrono::seconds;
using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr double kMaxSpan_s = 60 * 86'400.0;

// The user algorithms' own constants: the records must match the code that reads them.
constexpr double kMuGps = 3.986005e14;           // IS-GPS-200, 20.3.3.4.3.3
constexpr double kMuOthers = geodesy::kEarthMu;  // Galileo OS-SIS-ICD 5.1.1; BDS-SIS-ICD B1I 5.2.4.12
constexpr double kGeoTilt_rad = geodesy::radians(5);

double wrap(double angle) {
  return std::remainder(angle, 2 * geodesy::kPi);
}

/// `start + rate * t` wrapped to [-pi, pi]. Decades of orbits are 2e5 rad, at which doubles round to 1 mm on
/// the orbit; therefore the product and 2 pi are sums of two doubles (T. J. Dekker, Numer. Math. 18, 1971).
double advance(double start, double rate, GpsTime from, GpsTime to) {
  constexpr double kTwoPi = 2 * geodesy::kPi, kTwoPiRest = 2.4492935982947064e-16;
  const std::int64_t ns = to.nanoseconds() - from.nanoseconds();
  const std::int64_t whole = ns / GpsTime::kNanosecondsPerSecond;
  const auto whole_s = static_cast<double>(whole);
  const double rest_s = static_cast<double>(ns - whole * GpsTime::kNanosecondsPerSecond) * 1e-9;
  const double product = rate * whole_s;
  const double product_rest = std::fma(rate, whole_s, -product);
  const double cycles = std::nearbyint(product / kTwoPi);
  return wrap(start + (std::remainder(product, kTwoPi) - cycles * kTwoPiRest + product_rest + rate * rest_s));
}

/// Longitude of the ascending node on the rotating Earth, in [-pi, pi]; the rates are applied separately,
/// because their difference is rounded.
double node_longitude(const OrbitSlot& slot, GpsTime t) {
  return advance(advance(slot.node_longitude_rad, slot.node_rate, slot.epoch, t), -slot.earth_rate,
                 slot.epoch, t);
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

gnss::KeplerEphemeris kepler_record(const OrbitSlot& slot, const Issue& issue, GpsTime toe) {
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
    // BDS-SIS-ICD B1I 5.2.4.12: GEO elements refer to a plane tilted by 5 deg. In this plane the equator has
    // its ascending node on -x of the Earth at toe, and again at -x after the ICD's rotation.
    e.inclination = kGeoTilt_rad;
    node = geodesy::kPi;
    e.mean_anomaly = wrap(slot.node_longitude_rad - geodesy::kPi);
    rate = slot.earth_rate;
  } else {
    e.inclination = slot.inclination_rad;
    e.right_ascension_rate = slot.node_rate;
    node = node_longitude(slot, toe);
    e.mean_anomaly = advance(slot.argument_of_latitude_rad, slot.argument_of_latitude_rate, slot.epoch, toe);
    rate = slot.argument_of_latitude_rate;
  }
  e.right_ascension = wrap(node + slot.earth_rate * second_of_week);
  const double a = e.sqrt_a * e.sqrt_a;
  e.mean_motion_difference = rate - std::sqrt(mu / (a * a * a));

  // The issue is a counter of records, so that it differs from those of neighbours.
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

/// State in the ECEF axes of `t` on the near-circular J2 orbit that passes the slot at `t` and returns to the
/// same argument of latitude after exactly the slot's draconic period.
gnss::GlonassEphemeris glonass_start(const OrbitSlot& slot, GpsTime t) {
  const double node = node_longitude(slot, t);
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
  // tb is in the middle of each half hour of Moscow time, hence of UTC (ICD 4.4).
  constexpr int kSpacing_s = 1800;
  for (const OrbitSlot& slot : nominal_slots(gnss::System::GLONASS)) {
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
      // A record covers the half hours on both sides of it.
      if (tb + seconds(kSpacing_s) > begin) data.glonass.push_back(e);
      if (tb >= end) break;
    }
  }
}

void add_kepler(gnss::System system, GpsTime begin, GpsTime end, gnss::NavigationData& data) {
  const Issue issue = issue_of(system);
  for (const OrbitSlot& slot : nominal_slots(system)) {
    for (GpsTime toe = floor_to(issue, begin);; toe = toe + seconds(issue.spacing_s)) {
      data.kepler.push_back(kepler_record(slot, issue, toe));
      if (toe >= end) break;
    }
  }
}

using geodesy::CalendarTime;
using geodesy::GpsTime;
using geodesy::radians;

constexpr double kSecondsPerDay = 86'400;
constexpr double kEarthRateBeiDou = 7.2921150e-5;  // BDS-SIS-ICD B1I 3.0, 5.2.4.12

/// Secular rate of the node from J2 (Vallado, Fundamentals of Astrodynamics, eq. 9-37, e = 0) [rad/s].
double j2_node_rate(double a, double inclination) {
  const double n = std::sqrt(geodesy::kEarthMu / (a * a * a));
  const double q = geodesy::kSemiMajorAxis / a;
  return -1.5 * n * geodesy::kEarthJ2 * q * q * std::cos(inclination);
}

/// Rate of the argument of latitude for a ground track that repeats after `revolutions` in `days` nodal days.
double repeat_rate(const OrbitSlot& slot, int revolutions, int days) {
  return (slot.earth_rate - slot.node_rate) * revolutions / days;
}

/// Earth rotation angle (IERS Conventions 2010, eq. 5.15), with UT1 = UTC: within 0.004 deg.
double earth_rotation_angle(const CalendarTime& utc) {
  const GpsTime j2000 = geodesy::gps_from_calendar({2000, 1, 1, 12, 0, 0, 0});
  const double days = (geodesy::gps_from_calendar(utc) - j2000) / kSecondsPerDay;
  const double cycles = 0.7790572732640 + 0.00273781191135448 * days + std::fmod(days, 1.0);
  return 2 * geodesy::kPi * (cycles - std::floor(cycles));
}

// GPS SPS Performance Standard, 5th edition (2020), table 3.2-1: argument of latitude [deg] of the four
// baseline slots of each plane at 1993-07-01 00:00 UT, planes A to F. OrbitSlot D3 reads 35.136 here; the
// edition of 2001 has 35.156, 9 km along the orbit.
constexpr std::array<std::array<double, 4>, 6> kGpsLatitude_deg{{{268.126, 161.786, 11.676, 41.806},
                                                                 {80.956, 173.336, 309.976, 204.376},
                                                                 {111.876, 11.796, 339.666, 241.556},
                                                                 {135.226, 265.446, 35.136, 167.356},
                                                                 {197.046, 302.596, 66.066, 333.686},
                                                                 {238.886, 345.226, 105.206, 135.346}}};
constexpr std::array<double, 6> kGpsNode_deg{272.847, 332.847, 32.847, 92.847, 152.847, 212.847};

std::vector<OrbitSlot> gps_slots() {
  // The table's own Greenwich hour angle: 18 h 36 min 14.4 s.
  constexpr double kGreenwich_deg = (18 + 36 / 60.0 + 14.4 / 3600) * 15;
  std::vector<OrbitSlot> slots;
  std::uint8_t number = 0;
  for (std::size_t plane = 0; plane < kGpsNode_deg.size(); ++plane) {
    for (const double latitude_deg : kGpsLatitude_deg[plane]) {
      OrbitSlot s;
      s.id = {gnss::System::GPS, ++number};
      s.epoch = geodesy::gps_from_utc({1993, 7, 1, 0, 0, 0, 0});
      s.semi_major_axis_m = 26'559.7e3;
      s.inclination_rad = radians(55);
      s.node_longitude_rad = radians(kGpsNode_deg[plane] - kGreenwich_deg);
      s.node_rate = j2_node_rate(s.semi_major_axis_m, s.inclination_rad);
      s.argument_of_latitude_rad = radians(latitude_deg);
      s.argument_of_latitude_rate = repeat_rate(s, 2, 1);
      slots.push_back(s);
    }
  }
  return slots;
}

// ICD GLONASS L1, L2 (5.1), nominal orbital group: 8 slots in each of 3 planes, 64.8 deg; absolute longitudes
// of the nodes and arguments of latitude at 1983-01-01 00:00 Moscow time, and the rate of the nodes; the
// ground track repeats after 17 revolutions in 8 nodal days (40,544 s each). Frequency channels as in use. A
// test compares all of it with the satellites of 2020: an error of 2 deg after 37 years.
std::vector<OrbitSlot> glonass_slots() {
  constexpr std::array<int, 24> kChannel{1,  -4, 5, 6,  1, -4, 5, 6, -2, -7, 0, -1,
                                         -2, -7, 0, -1, 4, -3, 3, 2, 4,  -3, 3, 2};
  const CalendarTime epoch{1982, 12, 31, 21, 0, 0, 0};  // UTC
  const double greenwich = earth_rotation_angle(epoch);
  std::vector<OrbitSlot> slots;
  for (int j = 1; j <= 24; ++j) {
    const int plane = (j - 1) / 8;
    OrbitSlot s;
    s.id = {gnss::System::GLONASS, static_cast<std::uint8_t>(j)};
    s.epoch = geodesy::gps_from_utc(epoch);
    s.semi_major_axis_m = 25'508e3;
    s.inclination_rad = radians(64.8);
    s.node_longitude_rad = radians(251 + 15 / 60.0 + 120 * plane) - greenwich;
    s.node_rate = -0.59251e-3 / kSecondsPerDay;
    s.argument_of_latitude_rad = radians(145 + 26 / 60.0 + 37 / 3600.0 + 15 * (27 - 3 * j + 25 * plane));
    s.argument_of_latitude_rate = repeat_rate(s, 17, 8);
    s.glonass_channel = kChannel[static_cast<std::size_t>(j - 1)];
    slots.push_back(s);
  }
  return slots;
}

// European GNSS Service Centre, "Orbital and technical parameters", reference constellation at 2016-11-21
// 00:00 UTC in the celestial intermediate frame: a 29,599.8 km, e 0, i 56 deg, nodes 317.632 deg and every
// 120 deg, mean anomaly of slot A02 225.153 deg, 45 deg between slots and 15 deg between planes (Walker
// 24/3/1), and both rates.
std::vector<OrbitSlot> galileo_slots() {
  const CalendarTime epoch{2016, 11, 21, 0, 0, 0, 0};
  const double greenwich = earth_rotation_angle(epoch);
  std::vector<OrbitSlot> slots;
  for (int i = 0; i < 24; ++i) {
    const int plane = i / 8;
    OrbitSlot s;
    s.id = {gnss::System::Galileo, static_cast<std::uint8_t>(i + 1)};
    s.epoch = geodesy::gps_from_utc(epoch);
    s.semi_major_axis_m = 29'599.8e3;
    s.inclination_rad = radians(56);
    s.node_longitude_rad = radians(317.632 + 120 * plane) - greenwich;
    s.node_rate = radians(-0.02764398) / kSecondsPerDay;
    s.argument_of_latitude_rad = radians(180.153 + 15 * plane + 45 * (i % 8));
    s.argument_of_latitude_rate = radians(613.72253566) / kSecondsPerDay;
    slots.push_back(s);
  }
  return slots;
}

// BDS OS Performance Standard 3.0, 3.1: MEO Walker 24/3/1 at 21,528 km, GEO and IGSO at 35,786 km, both
// inclined 55 deg; GEO over 80, 110.5 and 140 deg east. The positions of the MEO planes and phases at the
// epoch are not published: they were read, to the degree, from the broadcast ephemerides of 2020-06-25. The
// IGSO track is centred on 118 deg east and its three planes coincide with those of the MEO: choices.
std::vector<OrbitSlot> beidou_slots() {
  // Satellites in order of phase, 45 deg apart. C41 to C46 were not in orbit yet: they fill the free slots.
  constexpr std::array<std::array<std::uint8_t, 8>, 3> kMeo{
      {{22, 19, 20, 32, 41, 33, 42, 21}, {37, 23, 25, 24, 26, 45, 36, 46}, {34, 43, 35, 29, 30, 27, 28, 44}}};
  constexpr std::array<double, 3> kNode_deg{42, 162, 282};
  constexpr std::array<double, 3> kPhase_deg{6, 21, 36};
  std::vector<OrbitSlot> slots;
  const auto add = [&slots](std::size_t number, double height_m, double node_deg) -> OrbitSlot& {
    OrbitSlot& s = slots.emplace_back();
    s.id = {gnss::System::BeiDou, static_cast<std::uint8_t>(number)};
    s.epoch = geodesy::gps_from_calendar({2020, 6, 25, 12, 0, 0, 0});
    s.earth_rate = kEarthRateBeiDou;
    s.semi_major_axis_m = geodesy::kSemiMajorAxis + height_m;
    s.node_longitude_rad = radians(node_deg);
    return s;
  };
  const auto incline = [](OrbitSlot& s, double argument_deg, int revolutions, int days) {
    s.inclination_rad = radians(55);
    s.node_rate = j2_node_rate(s.semi_major_axis_m, s.inclination_rad);
    s.argument_of_latitude_rad = radians(argument_deg);
    s.argument_of_latitude_rate = repeat_rate(s, revolutions, days);
  };
  for (std::size_t plane = 0; plane < 3; ++plane) {
    const double node_deg = kNode_deg[plane];
    for (std::size_t k = 0; k < 8; ++k) {
      incline(add(kMeo[plane][k], 21'528e3, node_deg), kPhase_deg[plane] + 45.0 * static_cast<double>(k), 13,
              7);
    }
    // Node and phase add up to the longitude at which the track crosses the equator northwards.
    incline(add(38 + plane, 35'786e3, node_deg), 118 - node_deg, 1, 1);
  }
  // The broadcast algorithm treats C01 to C05 and from C59 on as geostationary.
  constexpr std::array<double, 3> kGeo_deg{140, 80, 110.5};
  for (std::size_t k = 0; k < 3; ++k) add(59 + k, 35'786e3, kGeo_deg[k]).geostationary = true;
  std::sort(slots.begin(), slots.end(), [](const OrbitSlot& a, const OrbitSlot& b) { return a.id < b.id; });
  return slots;
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
  for (const gnss::System system : systems)
    if (system == gnss::System::GLONASS)
      add_glonass(begin, end, data);
    else
      add_kepler(system, begin, end, data);
  if (data.empty()) {
    throw InputError("nominal constellation: no system with published slots is chosen",
                     "choose from GPS, GLONASS, Galileo and BeiDou");
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

std::vector<OrbitSlot> nominal_slots(gnss::System system) {
  if (system == gnss::System::GPS) return gps_slots();
  if (system == gnss::System::GLONASS) return glonass_slots();
  if (system == gnss::System::Galileo) return galileo_slots();
  if (system == gnss::System::BeiDou) return beidou_slots();
  return {};
}

}  // namespace canyon::orbit
