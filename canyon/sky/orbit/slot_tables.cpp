// Declared in canyon/sky/orbit/nominal_constellation.hpp.
#include "canyon/sky/orbit/nominal_constellation.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"

namespace canyon::orbit {
namespace {

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

/// Rate of the argument of latitude that brings the slot's ground track back after `revolutions` in `days`
/// nodal days.
double repeat_rate(const Slot& slot, int revolutions, int days) {
  return (slot.earth_rate - slot.node_rate) * revolutions / days;
}

/// Earth rotation angle (IERS Conventions 2010, eq. 5.15), UT1 taken as UTC: within 0.004 deg.
double earth_rotation_angle(const CalendarTime& utc) {
  const GpsTime j2000 = geodesy::gps_from_calendar({2000, 1, 1, 12, 0, 0, 0});
  const double days = (geodesy::gps_from_calendar(utc) - j2000) / kSecondsPerDay;
  const double turns = 0.7790572732640 + 0.00273781191135448 * days + std::fmod(days, 1.0);
  return 2 * geodesy::kPi * (turns - std::floor(turns));
}

// GPS SPS Performance Standard, 5th edition (2020), table 3.2-1: argument of latitude [deg] of the four
// baseline slots of each plane at 1993-07-01 00:00 UT, planes A to F. Slot D3 reads 35.136 here; the edition
// of 2001 has 35.156, 9 km along the orbit.
constexpr std::array<std::array<double, 4>, 6> kGpsLatitude_deg{{{268.126, 161.786, 11.676, 41.806},
                                                                 {80.956, 173.336, 309.976, 204.376},
                                                                 {111.876, 11.796, 339.666, 241.556},
                                                                 {135.226, 265.446, 35.136, 167.356},
                                                                 {197.046, 302.596, 66.066, 333.686},
                                                                 {238.886, 345.226, 105.206, 135.346}}};
constexpr std::array<double, 6> kGpsNode_deg{272.847, 332.847, 32.847, 92.847, 152.847, 212.847};

std::vector<Slot> gps_slots() {
  // The table's own Greenwich hour angle: 18 h 36 min 14.4 s.
  constexpr double kGreenwich_deg = (18 + 36 / 60.0 + 14.4 / 3600) * 15;
  std::vector<Slot> slots;
  std::uint8_t number = 0;
  for (std::size_t plane = 0; plane < kGpsNode_deg.size(); ++plane) {
    for (const double latitude_deg : kGpsLatitude_deg[plane]) {
      Slot s;
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
// test holds all of it against the satellites of 2020: 2 deg off after 37 years.
std::vector<Slot> glonass_slots() {
  constexpr std::array<int, 24> kChannel{1,  -4, 5, 6,  1, -4, 5, 6, -2, -7, 0, -1,
                                         -2, -7, 0, -1, 4, -3, 3, 2, 4,  -3, 3, 2};
  const CalendarTime epoch{1982, 12, 31, 21, 0, 0, 0};  // UTC
  const double greenwich = earth_rotation_angle(epoch);
  std::vector<Slot> slots;
  for (int j = 1; j <= 24; ++j) {
    const int plane = (j - 1) / 8;
    Slot s;
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
std::vector<Slot> galileo_slots() {
  const CalendarTime epoch{2016, 11, 21, 0, 0, 0, 0};
  const double greenwich = earth_rotation_angle(epoch);
  std::vector<Slot> slots;
  for (int i = 0; i < 24; ++i) {
    const int plane = i / 8;
    Slot s;
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
// inclined 55 deg; GEO over 80, 110.5 and 140 deg east. Where the MEO planes and phases lie at the epoch is
// no published number: they were read, to the degree, from the broadcast ephemerides of 2020-06-25. The IGSO
// track is centred on 118 deg east and its three planes go with those of the MEO: choices.
std::vector<Slot> beidou_slots() {
  // Satellites in order of phase, 45 deg apart. C41 to C46 were not up yet: they fill the free slots.
  constexpr std::array<std::array<std::uint8_t, 8>, 3> kMeo{
      {{22, 19, 20, 32, 41, 33, 42, 21}, {37, 23, 25, 24, 26, 45, 36, 46}, {34, 43, 35, 29, 30, 27, 28, 44}}};
  constexpr std::array<double, 3> kNode_deg{42, 162, 282};
  constexpr std::array<double, 3> kPhase_deg{6, 21, 36};
  std::vector<Slot> slots;
  const auto add = [&slots](std::size_t number, double height_m, double node_deg) -> Slot& {
    Slot& s = slots.emplace_back();
    s.id = {gnss::System::BeiDou, static_cast<std::uint8_t>(number)};
    s.epoch = geodesy::gps_from_calendar({2020, 6, 25, 12, 0, 0, 0});
    s.earth_rate = kEarthRateBeiDou;
    s.semi_major_axis_m = geodesy::kSemiMajorAxis + height_m;
    s.node_longitude_rad = radians(node_deg);
    return s;
  };
  const auto incline = [](Slot& s, double argument_deg, int revolutions, int days) {
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
  // The broadcast algorithm takes C01 to C05 and C59 upwards for geostationary.
  constexpr std::array<double, 3> kGeo_deg{140, 80, 110.5};
  for (std::size_t k = 0; k < 3; ++k) {
    add(59 + k, 35'786e3, kGeo_deg[k]).geostationary = true;
  }
  std::sort(slots.begin(), slots.end(), [](const Slot& a, const Slot& b) { return a.id < b.id; });
  return slots;
}

}  // namespace

std::vector<Slot> nominal_slots(gnss::System system) {
  if (system == gnss::System::GPS) return gps_slots();
  if (system == gnss::System::GLONASS) return glonass_slots();
  if (system == gnss::System::Galileo) return galileo_slots();
  if (system == gnss::System::BeiDou) return beidou_slots();
  return {};
}

}  // namespace canyon::orbit
