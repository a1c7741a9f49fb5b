#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "canyon/base/geodesy/gps_time.hpp"

namespace canyon::geodesy {

/// Proleptic Gregorian calendar date and time of day. The function that uses it defines the time scale.
struct CalendarTime {
  int year = 1980;
  int month = 1;                ///< 1 to 12
  int day = 6;                  ///< 1 to 31
  int hour = 0;                 ///< 0 to 23
  int minute = 0;               ///< 0 to 59
  int second = 0;               ///< 0 to 59; 60 only in UTC during a leap second
  std::int64_t nanosecond = 0;  ///< 0 to 999,999,999

  friend bool operator==(const CalendarTime&, const CalendarTime&) = default;
};

/// GPST minus UTC [s] at an instant; 18 since 2017-01-01; 0 before 1980. The table ends with the leap second
/// of 2016-12-31 (IERS Bulletin C announces none up to this release); later times get its value.
[[nodiscard]] int leap_seconds(GpsTime t);
/// The instant since which leap_seconds() has its value at `t`, 00:00:00 UTC of a day; the GPS epoch before
/// 1981-07-01.
[[nodiscard]] GpsTime last_leap_second(GpsTime t);

/// GPST as a calendar date (the date that RINEX prints for GPS).
[[nodiscard]] CalendarTime calendar_from_gps(GpsTime t);
/// Throws InputError with the field's name if a field is out of range (second 60 included).
[[nodiscard]] GpsTime gps_from_calendar(const CalendarTime& gpst);

/// UTC; a leap second is returned as second 60.
[[nodiscard]] CalendarTime utc_from_gps(GpsTime t);
/// Throws InputError if a field is out of range, or for second 60 without a leap second at that time.
[[nodiscard]] GpsTime gps_from_utc(const CalendarTime& utc);

/// Converts POSIX time, whole nanoseconds since 1970-01-01 00:00:00 UTC without leap seconds; a repeated
/// second maps to its second occurrence.
[[nodiscard]] GpsTime gps_from_unix(std::int64_t nanoseconds_since_1970);

/// 1980-01-06T00:00:00Z in POSIX time [s], day 3657.
inline constexpr std::int64_t kGpsEpochUnix_s = 315'964'800;

/// POSIX time [ns] of an instant, without leap seconds. gps_from_unix() is its inverse.
[[nodiscard]] inline std::int64_t unix_from_gps(GpsTime t) {
  return t.nanoseconds() + (kGpsEpochUnix_s - leap_seconds(t)) * GpsTime::kNanosecondsPerSecond;
}

/// BDT is 14 s behind GPST. Its week 0 begins 2006-01-01 00:00:00 UTC, in GPS week 1356 (BDS-SIS-ICD B1I 3.0,
/// 3.3).
inline constexpr int kBdtWeekOffset = 1356;
inline constexpr int kBdtSecondsOffset = 14;
/// @param bdt_week full BeiDou week; @param seconds_of_week [s]. Throws like GpsTime::from_week.
[[nodiscard]] GpsTime gps_from_bdt(int bdt_week, double seconds_of_week);

/// GLONASST is UTC(SU) plus 3 h, leap seconds included (ICD GLONASS L1, L2 5.1, 3.3.3).
[[nodiscard]] CalendarTime glonass_from_gps(GpsTime t);

/// ISO 8601 date and time, extended or basic ("20190428T125803Z"), fraction up to 9 digits, comma or point:
/// "2019-04-28T12:58:03.5Z" and offsets ("+08:00") are UTC; a trailing " GPST" or "GPS" marks GPS time; a
/// bare date is its midnight. Without any mark the time is UTC. Suffixes of RFC 9557 after Z or an offset
/// ("+02:00[Europe/Berlin]", "[u-ca=iso8601]") are ignored; the offset is not compared with the zone.
/// Suffixes with '!' are rejected, because they are mandatory. Throws InputError with the expected format.
[[nodiscard]] GpsTime parse_time(std::string_view text);

/// "2019-04-28T12:58:03.500Z" (UTC); `decimals` 0 to 9 digits of the second, truncated.
[[nodiscard]] std::string format_utc(GpsTime t, int decimals = 3);
/// "2019-04-28T12:58:21.500 GPST".
[[nodiscard]] std::string format_gpst(GpsTime t, int decimals = 3);

/// "; 1024 weeks later it would be near: ..." if `reported` and `expected` differ by whole GPS week
/// rollovers, within 8 days, as dates of old receivers do; else empty.
[[nodiscard]] std::string rollover_text(GpsTime reported, GpsTime expected);

/// Whether a text for parse_time() names its time scale: Z, UTC, GPST or an offset from UTC. A time without
/// one is read as UTC, although local time may be meant.
[[nodiscard]] bool names_time_scale(std::string_view text);

/// parse_time() for an instant that can be simulated, recorded and written to files: GPS weeks 0 to 9999,
/// 1980-01-06 to 2171-08-31. Throws InputError for any other, and as parse_time() does.
[[nodiscard]] GpsTime parse_simulated_time(std::string_view text);

}  // namespace canyon::geodesy
