#include "canyon/broadcast/cnav_fields.hpp"

#include <algorithm>
#include <cmath>

namespace canyon::broadcast {

using geodesy::GpsTime;

GpsTime whole_300_s(GpsTime t) {
  constexpr double kStep_s = 300, kLast_s = GpsTime::kSecondsPerWeek - kStep_s;
  const double second = t.seconds_of_week();
  return t + (std::min(std::round(second / kStep_s) * kStep_s, kLast_s) - second);
}

gnss::KeplerEphemeris referred_to(gnss::KeplerEphemeris e, GpsTime toe, GpsTime toc, double earth_gm) {
  const double orbit_s = toe - e.toe, clock_s = toc - e.toc;
  const double axis_m = e.sqrt_a * e.sqrt_a;
  e.mean_anomaly += (std::sqrt(earth_gm / axis_m) / axis_m + e.mean_motion_difference) * orbit_s;
  e.right_ascension += e.right_ascension_rate * orbit_s;
  e.inclination += e.inclination_rate * orbit_s;
  e.toe = toe;
  e.af0 += (e.af1 + e.af2 * clock_s) * clock_s;
  e.af1 += 2 * e.af2 * clock_s;
  e.toc = toc;
  return e;
}

void put_reference_time(Bits& bits, GpsTime t) {
  bits.positive(t.seconds_of_week(), 300, 11);
}

void put_ellipse(Bits& bits, const gnss::KeplerEphemeris& e, double reference_m) {
  bits.number(e.sqrt_a * e.sqrt_a - reference_m, 0x1p-9, 26);
  bits.put(0, 25);
  bits.angle(e.mean_motion_difference, 0x1p-44, 17);
  bits.put(0, 23);
  bits.angle(e.mean_anomaly, 0x1p-32, 33);
  bits.positive(e.eccentricity, 0x1p-34, 33);
  bits.angle(e.argument_of_perigee, 0x1p-32, 33);
}

void put_plane(Bits& bits, const gnss::KeplerEphemeris& e, double node_rate, int node_rate_bits) {
  bits.angle(e.right_ascension, 0x1p-32, 33);
  bits.angle(e.inclination, 0x1p-32, 33);
  bits.angle(node_rate, 0x1p-44, node_rate_bits);
  bits.angle(e.inclination_rate, 0x1p-44, 15);
  bits.number(e.cis, 0x1p-30, 16);
  bits.number(e.cic, 0x1p-30, 16);
  bits.number(e.crs, 0x1p-8, 24);
  bits.number(e.crc, 0x1p-8, 24);
  bits.number(e.cus, 0x1p-30, 21);
  bits.number(e.cuc, 0x1p-30, 21);
}

void put_utc(Bits& bits, int leap_seconds, int week, int day, int day_bits) {
  bits.put(0, 16 + 13 + 7);
  bits.count(leap_seconds, 8);
  bits.put(0, 16);
  bits.count(week, 13);
  bits.count(week, 13);
  bits.count(day, day_bits);
  bits.count(leap_seconds, 8);
}

}  // namespace canyon::broadcast
