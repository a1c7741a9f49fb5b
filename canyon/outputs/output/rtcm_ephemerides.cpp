// Declared in canyon/outputs/output/rtcm.hpp.
#include <algorithm>
#include <cmath>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/outputs/output/epoch_values.hpp"
#include "canyon/outputs/output/rtcm.hpp"
#include "canyon/sky/broadcast/bits.hpp"
#include "canyon/sky/gnss/broadcast_messages.hpp"

namespace canyon::output::rtcm {

using broadcast::Bits;
using geodesy::GpsTime;
using gnss::KeplerEphemeris;
using gnss::System;

namespace {

constexpr double kRepeat_s = 30;

/// A message's first fields: its number and the satellite.
Bits head(int message, int satellite, int satellite_bits) {
  return Bits().count(message, 12).count(satellite, satellite_bits);
}

/// Steps that differ between systems.
struct Steps {
  int correction_bits;
  double correction;
  int radius_bits;
  double radius;
  int toe_bits, toe_s;
};
constexpr Steps kGps{16, 0x1p-29, 16, 0x1p-5, 16, 16}, kGalileo{16, 0x1p-29, 16, 0x1p-5, 14, 60},
    kBeiDou{18, 0x1p-31, 18, 0x1p-6, 17, 8};

/// The fields that all Keplerian messages have in the same order: Crs to Cus, the square root of the axis,
/// toe, Cic to OMEGA DOT.
void put_orbit(Bits& to, const KeplerEphemeris& e, const Steps& s, double toe_s) {
  to.number(e.crs, s.radius, s.radius_bits)
      .angle(e.mean_motion_difference, 0x1p-43, 16)
      .angle(e.mean_anomaly, 0x1p-31, 32)
      .number(e.cuc, s.correction, s.correction_bits)
      .positive(e.eccentricity, 0x1p-33, 32)
      .number(e.cus, s.correction, s.correction_bits)
      .positive(e.sqrt_a, 0x1p-19, 32)
      .positive(toe_s, s.toe_s, s.toe_bits)
      .number(e.cic, s.correction, s.correction_bits)
      .angle(e.right_ascension, 0x1p-31, 32)
      .number(e.cis, s.correction, s.correction_bits)
      .angle(e.inclination, 0x1p-31, 32)
      .number(e.crc, s.radius, s.radius_bits)
      .angle(e.argument_of_perigee, 0x1p-31, 32)
      .angle(e.right_ascension_rate, 0x1p-43, 24);
}

int fit_flag(const KeplerEphemeris& e) {
  return e.fit_interval_h > 4 ? 1 : 0;
}

Bits gps(const KeplerEphemeris& e) {
  Bits w = head(1019, e.id.number, 6);
  w.count(e.toe.week(), 10)
      .count(broadcast::accuracy_index(e.accuracy_m), 4)
      .count(e.data_sources, 2)
      .angle(e.inclination_rate, 0x1p-43, 14)
      .count(e.iode, 8)
      .positive(e.toc.seconds_of_week(), 16, 16)
      .number(e.af2, 0x1p-55, 8)
      .number(e.af1, 0x1p-43, 16)
      .number(e.af0, 0x1p-31, 22)
      .count(e.iodc, 10);
  put_orbit(w, e, kGps, e.toe.seconds_of_week());
  return w.number(e.group_delay[0], 0x1p-31, 8).count(e.health, 6).count(e.l2p_flag, 1).count(fit_flag(e), 1);
}

Bits qzss(const KeplerEphemeris& e) {
  Bits w = head(1044, e.id.number, 4);
  w.positive(e.toc.seconds_of_week(), 16, 16)
      .number(e.af2, 0x1p-55, 8)
      .number(e.af1, 0x1p-43, 16)
      .number(e.af0, 0x1p-31, 22)
      .count(e.iode, 8);
  put_orbit(w, e, kGps, e.toe.seconds_of_week());
  return w.angle(e.inclination_rate, 0x1p-43, 14)
      .count(e.data_sources, 2)
      .count(e.toe.week(), 10)
      .count(broadcast::accuracy_index(e.accuracy_m), 4)
      .count(e.health, 6)
      .number(e.group_delay[0], 0x1p-31, 8)
      .count(e.iodc, 10)
      .count(fit_flag(e), 1);
}

Bits galileo(const KeplerEphemeris& e) {
  constexpr int kWeekOffset = 1024;  // of Galileo's week 0, 1999-08-22
  const bool fnav = is_galileo_fnav(e);
  Bits w = head(fnav ? 1045 : 1046, e.id.number, 6);
  w.count(e.toe.week() - kWeekOffset, 12)
      .count(e.iode, 10)
      .count(broadcast::sisa_index(e.accuracy_m), 8)
      .angle(e.inclination_rate, 0x1p-43, 14)
      .positive(e.toc.seconds_of_week(), 60, 14)
      .number(e.af2, 0x1p-59, 6)
      .number(e.af1, 0x1p-46, 21)
      .number(e.af0, 0x1p-34, 31);
  put_orbit(w, e, kGalileo, e.toe.seconds_of_week());
  w.number(e.group_delay[0], 0x1p-32, 10);
  // RINEX has the flags in one word: E1-B's data validity, then two bits of health, then E5a's and E5b's.
  const auto health = [&](int at) { w.count(e.health >> (at + 1), 2).count(e.health >> at, 1); };
  if (fnav) {
    health(3);
    return w.count(0, 7);
  }
  w.number(e.group_delay[1], 0x1p-32, 10);
  health(6);
  health(0);
  return w.count(0, 2);
}

Bits beidou(const KeplerEphemeris& e) {
  const std::chrono::seconds offset(geodesy::kBdtSecondsOffset);
  const GpsTime toe = e.toe - offset, toc = e.toc - offset;  // BDT
  constexpr double kGroupDelay_s = 1e-10;
  Bits w = head(1042, e.id.number, 6);
  w.count(toe.week() - geodesy::kBdtWeekOffset, 13)
      .count(broadcast::accuracy_index(e.accuracy_m), 4)
      .angle(e.inclination_rate, 0x1p-43, 14)
      .count(e.iode, 5)
      .positive(toc.seconds_of_week(), 8, 17)
      .number(e.af2, 0x1p-66, 11)
      .number(e.af1, 0x1p-50, 22)
      .number(e.af0, 0x1p-33, 24)
      .count(e.iodc, 5);
  put_orbit(w, e, kBeiDou, toe.seconds_of_week());
  return w.number(e.group_delay[0], kGroupDelay_s, 10)
      .number(e.group_delay[1], kGroupDelay_s, 10)
      .count(e.health, 1);
}

}  // namespace

Bits ephemeris(const KeplerEphemeris& e) {
  const int n = e.id.number;
  switch (e.id.system) {
    case System::GPS:
      return n <= 32 ? gps(e) : Bits();
    case System::QZSS:
      return n <= 10 ? qzss(e) : Bits();
    case System::Galileo:
      return n <= 36 ? galileo(e) : Bits();
    case System::BeiDou:
      return n <= 63 ? beidou(e) : Bits();
    case System::GLONASS:
    case System::SBAS:
      break;
  }
  return {};
}

// DF104 to DF136 follow the strings of the satellite's own message (ICD GLONASS L1, L2 5.1, table 4.5).
Bits ephemeris(const gnss::GlonassEphemeris& e) {
  if (e.id.number > 24) return {};
  const geodesy::CalendarTime tb = geodesy::glonass_from_gps(e.toe),
                              tk = geodesy::glonass_from_gps(e.transmission);
  const int tb_minutes = tb.hour * 60 + tb.minute;
  // Years are counted in fours from 1996 on, days from the first of January of such a leap year.
  const int four_years = (tb.year - 1996) / 4;
  const GpsTime first_day = geodesy::gps_from_calendar({.year = 1996 + 4 * four_years, .month = 1, .day = 1});
  const GpsTime day = geodesy::gps_from_calendar({.year = tb.year, .month = tb.month, .day = tb.day});
  const int day_number = static_cast<int>((day - first_day) / 86'400) + 1;
  constexpr double kKilo = 1e3;

  Bits w = head(1020, e.id.number, 6);
  w.count(e.channel + 7, 5)
      .count(0, 1 + 1)  // almanac health: not available
      .count(1, 2)      // P1: tb changes every 30 min
      .count(tk.hour, 5)
      .count(tk.minute, 6)
      .count(tk.second >= 30 ? 1 : 0, 1)
      .count(e.health != 0 ? 1 : 0, 1)
      .count(tb_minutes / 15 % 2, 1)  // P2: tb is an odd quarter of an hour
      .count(tb_minutes / 15, 7);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    w.sign_magnitude(e.velocity_mps[axis] / kKilo, 0x1p-20, 24)
        .sign_magnitude(e.position_m[axis] / kKilo, 0x1p-11, 27)
        .sign_magnitude(e.acceleration_mps2[axis] / kKilo, 0x1p-30, 5);
  }
  return w
      .count(0, 1)  // P3: four satellites in the almanac's frame
      .sign_magnitude(e.frequency_bias, 0x1p-40, 11)
      .count(0, 2)                      // P
      .count(e.health != 0 ? 1 : 0, 1)  // ln
      .sign_magnitude(-e.clock_bias_s, 0x1p-30, 22)
      .sign_magnitude(e.group_delay_difference_s, 0x1p-30, 5)
      .positive(e.age_days, 1, 5)
      .count(0, 1 + 4)  // P4, FT
      .count(day_number, 11)
      .count(1, 2)            // GLONASS-M
      .count(0, 1 + 11 + 32)  // nothing of string 5: NA, tau c
      .count(four_years + 1, 5)
      .count(0, 22)  // tau GPS
      .count(e.health != 0 ? 1 : 0, 1)
      .count(0, 7);
}

template <typename Ephemeris>
void Ephemerides::add_due(const std::vector<Ephemeris>& records, const simulation::Epoch& epoch,
                          std::vector<Bits>& messages) {
  const GpsTime now = epoch.observed.time;
  // The simulated sky uses the nearest in time, the newer one of two.
  std::map<Key, const Ephemeris*> nearest;
  for (const auto& satellite : epoch.observed.satellites) {
    if (!measured(satellite)) continue;
    nearest[{satellite.id, false}] = nullptr;
    if (satellite.id.system == System::Galileo) nearest[{satellite.id, true}] = nullptr;
  }
  for (const Ephemeris& record : records) {
    Key key{record.id, false};
    if constexpr (std::is_same_v<Ephemeris, KeplerEphemeris>) key.second = is_galileo_fnav(record);
    const auto at = nearest.find(key);
    if (at == nearest.end()) continue;
    if (at->second == nullptr || std::abs(now - record.toe) <= std::abs(now - at->second->toe))
      at->second = &record;
  }
  for (const auto& [key, record] : nearest) {
    if (record == nullptr || !validity(*record).contains(now - record->toe)) continue;
    const auto [sent, first] = sent_.try_emplace(key);
    Sent& last = sent->second;
    Bits message = ephemeris(*record);
    if (!first && last.message == message && now - last.at < kRepeat_s) continue;
    if (message.size() > 0) messages.push_back(message);
    last = {now, std::move(message)};
  }
}

std::vector<Bits> Ephemerides::due(const simulation::Epoch& epoch) {
  std::vector<Bits> messages;
  if (epoch.navigation == nullptr) return messages;
  add_due(epoch.navigation->kepler, epoch, messages);
  add_due(epoch.navigation->glonass, epoch, messages);
  return messages;
}

}  // namespace canyon::output::rtcm
