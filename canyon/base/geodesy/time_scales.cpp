#include "canyon/base/geodesy/time_scales.hpp"

#include <fmt/format.h>
#include <array>
#include <cmath>
#include <optional>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon::geodesy {

namespace {

using std::chrono::seconds;

// Days from 1970-01-01 of a proleptic Gregorian date and back (H. Hinnant, chrono-compatible low-level date
// algorithms, public domain); <chrono>'s calendar is missing from GCC 10.
constexpr std::int64_t days_from_civil(std::int64_t y, int m, int d) {
  y -= m <= 2 ? 1 : 0;
  const std::int64_t era = (y >= 0 ? y : y - 399) / 400;
  const std::int64_t yoe = y - era * 400;
  const std::int64_t doy = (153 * (m > 2 ? m - 3 : m + 9) + 2) / 5 + d - 1;
  const std::int64_t doe = yoe * 365 + yoe / 4 - yoe / 100 + doy;
  return era * 146097 + doe - 719468;
}

constexpr void civil_from_days(std::int64_t z, CalendarTime& out) {
  z += 719468;
  const std::int64_t era = (z >= 0 ? z : z - 146096) / 146097;
  const std::int64_t doe = z - era * 146097;
  const std::int64_t yoe = (doe - doe / 1460 + doe / 36524 - doe / 146096) / 365;
  const std::int64_t doy = doe - (365 * yoe + yoe / 4 - yoe / 100);
  const std::int64_t mp = (5 * doy + 2) / 153;
  out.day = static_cast<int>(doy - (153 * mp + 2) / 5 + 1);
  out.month = static_cast<int>(mp < 10 ? mp + 3 : mp - 9);
  out.year = static_cast<int>(yoe + era * 400 + (out.month <= 2 ? 1 : 0));
}

constexpr std::int64_t kSecondsPerDay = 86'400;
constexpr std::int64_t kGpsEpochDays = kGpsEpochUnix_s / kSecondsPerDay;
static_assert(kGpsEpochDays == days_from_civil(1980, 1, 6));

// First UTC day with a new offset (IERS Bulletin C; the offset of 1980-01-06 is 0).
struct LeapEntry {
  int year, month;
  int gpst_minus_utc;
};
constexpr std::array<LeapEntry, 18> kLeapTable{{{1981, 7, 1},
                                                {1982, 7, 2},
                                                {1983, 7, 3},
                                                {1985, 7, 4},
                                                {1988, 1, 5},
                                                {1990, 1, 6},
                                                {1991, 1, 7},
                                                {1992, 7, 8},
                                                {1993, 7, 9},
                                                {1994, 7, 10},
                                                {1996, 1, 11},
                                                {1997, 7, 12},
                                                {1999, 1, 13},
                                                {2006, 1, 14},
                                                {2009, 1, 15},
                                                {2012, 7, 16},
                                                {2015, 7, 17},
                                                {2017, 1, 18}}};

/// GPST second at which the entry's UTC day begins, just after the leap second.
constexpr std::int64_t gps_second_of(const LeapEntry& entry) {
  return (days_from_civil(entry.year, entry.month, 1) - kGpsEpochDays) * kSecondsPerDay +
         entry.gpst_minus_utc;
}

constexpr std::int64_t floor_seconds(GpsTime t) {
  std::int64_t s = t.nanoseconds() / GpsTime::kNanosecondsPerSecond;
  if (t.nanoseconds() % GpsTime::kNanosecondsPerSecond < 0) --s;
  return s;
}

/// True during the second 60 before a table entry.
bool in_leap_second(GpsTime t) {
  const std::int64_t s = floor_seconds(t);
  for (const LeapEntry& entry : kLeapTable)
    if (s == gps_second_of(entry) - 1) return true;
  return false;
}

int days_in_month(int year, int month) {
  constexpr std::array<int, 12> kDays{31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  const bool leap = (year % 4 == 0 && year % 100 != 0) || year % 400 == 0;
  return month == 2 && leap ? 29 : kDays[static_cast<std::size_t>(month - 1)];
}

void check_field(const char* name, std::int64_t value, std::int64_t low, std::int64_t high) {
  if (value < low || value > high) {
    throw InputError(fmt::format("{} {} is out of range", name, value),
                     fmt::format("it runs from {} to {}", low, high));
  }
}

void check_calendar(const CalendarTime& c, int max_second) {
  check_field("year", c.year, 1700, 2260);
  check_field("month", c.month, 1, 12);
  check_field("day", c.day, 1, days_in_month(c.year, c.month));
  check_field("hour", c.hour, 0, 23);
  check_field("minute", c.minute, 0, 59);
  check_field("second", c.second, 0, max_second);
  check_field("nanosecond", c.nanosecond, 0, 999'999'999);
}

/// Calendar date and time plus `offset` (whole minutes); second 60 stays second 60.
CalendarTime shifted(const CalendarTime& c, std::chrono::minutes offset) {
  check_calendar(c, 60);
  CalendarTime plain = c;
  if (c.second == 60) plain.second = 59;
  CalendarTime result = calendar_from_gps(gps_from_calendar(plain) + offset);
  result.second = c.second;
  return result;
}

std::string format(const CalendarTime& c, int decimals, std::string_view mark) {
  std::string text =
      fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}", c.year, c.month, c.day, c.hour, c.minute, c.second);
  if (decimals > 0)
    text += "." + fmt::format("{:09}", c.nanosecond).substr(0, static_cast<std::size_t>(decimals));
  text += mark;
  return text;
}

/// Consumes exactly `digits` decimal digits at the front.
std::optional<int> take_digits(std::string_view& text, std::size_t digits) {
  if (text.size() < digits) return std::nullopt;
  int value = 0;
  for (std::size_t i = 0; i < digits; ++i) {
    if (text[i] < '0' || text[i] > '9') return std::nullopt;
    value = value * 10 + (text[i] - '0');
  }
  text.remove_prefix(digits);
  return value;
}

bool take(std::string_view& text, std::string_view prefix) {
  if (text.substr(0, prefix.size()) != prefix) return false;
  text.remove_prefix(prefix.size());
  return true;
}

/// A time without its suffixes of RFC 9557, which do not change the instant. Throws for a suffix with '!',
/// which is mandatory (3.3), because zones are not supported.
std::string_view without_suffixes(std::string_view time, const InputError& wrong) {
  while (time.ends_with(']')) {
    const std::size_t open = time.rfind('[');
    if (open == std::string_view::npos || open + 2 == time.size()) throw wrong;
    const std::string_view suffix = time.substr(open);
    if (suffix[1] == '!' && suffix != "[!u-ca=iso8601]") {
      throw InputError(fmt::format("the suffix '{}' of a time is mandatory and not supported", suffix),
                       "check the time, and remove the '!'");
    }
    time = trim(time.substr(0, open));
  }
  return time;
}

}  // namespace

int leap_seconds(GpsTime t) {
  const std::int64_t s = floor_seconds(t);
  int offset = 0;
  for (const LeapEntry& entry : kLeapTable)
    if (s >= gps_second_of(entry)) offset = entry.gpst_minus_utc;
  return offset;
}

GpsTime last_leap_second(GpsTime t) {
  const std::int64_t s = floor_seconds(t);
  std::int64_t last = 0;
  for (const LeapEntry& entry : kLeapTable)
    if (s >= gps_second_of(entry)) last = gps_second_of(entry);
  return GpsTime{} + seconds(last);
}

CalendarTime calendar_from_gps(GpsTime t) {
  const std::int64_t s = floor_seconds(t);
  std::int64_t day = s / kSecondsPerDay;
  if (s % kSecondsPerDay < 0) --day;
  const auto second_of_day = static_cast<int>(s - day * kSecondsPerDay);
  CalendarTime c;
  civil_from_days(day + kGpsEpochDays, c);
  c.hour = second_of_day / 3600;
  c.minute = second_of_day / 60 % 60;
  c.second = second_of_day % 60;
  c.nanosecond = t.nanoseconds() - s * GpsTime::kNanosecondsPerSecond;
  return c;
}

GpsTime gps_from_calendar(const CalendarTime& gpst) {
  check_calendar(gpst, 59);
  const std::int64_t seconds =
      (days_from_civil(gpst.year, gpst.month, gpst.day) - kGpsEpochDays) * kSecondsPerDay +
      std::int64_t{gpst.hour} * 3600 + std::int64_t{gpst.minute} * 60 + gpst.second;
  return GpsTime::from_nanoseconds(seconds * GpsTime::kNanosecondsPerSecond + gpst.nanosecond);
}

CalendarTime utc_from_gps(GpsTime t) {
  if (in_leap_second(t)) {
    CalendarTime c = calendar_from_gps(t - seconds(leap_seconds(t) + 1));
    c.second = 60;
    return c;
  }
  return calendar_from_gps(t - seconds(leap_seconds(t)));
}

GpsTime gps_from_utc(const CalendarTime& utc) {
  check_calendar(utc, 60);
  CalendarTime base = utc;
  if (utc.second == 60) base.second = 59;
  // Compares the linear UTC count, so that the offset of the new day is valid from its midnight.
  const GpsTime t_linear = gps_from_calendar(base);
  int offset = 0;
  for (const LeapEntry& entry : kLeapTable) {
    const std::int64_t begins = gps_second_of(entry) - entry.gpst_minus_utc;
    if (floor_seconds(t_linear) >= begins) offset = entry.gpst_minus_utc;
  }
  GpsTime t = t_linear + seconds(offset);
  if (utc.second == 60) {
    t = t + seconds(1);
    if (!in_leap_second(t)) {
      throw InputError(format(utc, 0, "Z") + " is not a time: there was no leap second",
                       "seconds run from 0 to 59");
    }
  }
  return t;
}

GpsTime gps_from_unix(std::int64_t nanoseconds_since_1970) {
  const GpsTime without_leaps =
      GpsTime::from_nanoseconds(nanoseconds_since_1970 - kGpsEpochUnix_s * GpsTime::kNanosecondsPerSecond);
  // Adds a second, so that a leap second is over at the second occurrence of its repeated second.
  const GpsTime about = without_leaps + std::chrono::seconds(leap_seconds(without_leaps) + 1);
  return without_leaps + std::chrono::seconds(leap_seconds(about));
}

GpsTime gps_from_bdt(int bdt_week, double seconds_of_week) {
  return GpsTime::from_week(bdt_week + kBdtWeekOffset, seconds_of_week) + seconds(kBdtSecondsOffset);
}

CalendarTime glonass_from_gps(GpsTime t) {
  if (in_leap_second(t)) {
    CalendarTime c = calendar_from_gps(t - seconds(leap_seconds(t) + 1) + std::chrono::hours(3));
    c.second = 60;
    return c;
  }
  return calendar_from_gps(t - seconds(leap_seconds(t)) + std::chrono::hours(3));
}

GpsTime parse_time(std::string_view whole) {
  const InputError wrong(fmt::format("'{}' is not a time", whole),
                         "write UTC as 2019-04-28T12:58:03.5Z or GPS time as 2019-04-28T12:58:21.5 GPST");
  std::string_view rest = without_suffixes(trim(whole), wrong);
  const bool has_suffix = whole.find('[') != std::string_view::npos;
  CalendarTime c;
  const auto number = [&rest, &wrong](std::size_t digits) {
    const std::optional<int> value = take_digits(rest, digits);
    if (!value) throw wrong;
    return *value;
  };
  const auto expect = [&rest, &wrong](std::string_view prefix) {
    if (!take(rest, prefix)) throw wrong;
  };
  c.year = number(4);
  const bool extended = take(rest, "-");  // else ISO 8601's basic format, 20190428T125803Z
  c.month = number(2);
  if (extended) expect("-");
  c.day = number(2);
  if (!rest.empty() && (rest.front() == 'T' || rest.front() == 't' ||
                        (rest.front() == ' ' && rest.size() > 1 && rest[1] >= '0' && rest[1] <= '9'))) {
    rest.remove_prefix(1);
    c.hour = number(2);
    if (extended) expect(":");
    c.minute = number(2);
    const bool digits_follow = !rest.empty() && rest.front() >= '0' && rest.front() <= '9';
    if (extended ? take(rest, ":") : digits_follow) {
      c.second = number(2);
      if (take(rest, ".") || take(rest, ",")) {
        std::int64_t scale = 100'000'000;
        std::size_t digits = 0;
        while (!rest.empty() && rest.front() >= '0' && rest.front() <= '9') {
          c.nanosecond += scale * (rest.front() - '0');
          scale /= 10;
          rest.remove_prefix(1);
          ++digits;
        }
        if (digits == 0 || digits > 9) throw wrong;
      }
    }
  }
  rest = trim(rest);
  if (rest.empty() && has_suffix) {
    throw InputError(fmt::format("the time '{}' has no offset from UTC before its suffix", whole),
                     "write it, such as 2019-04-28T14:58:03+02:00[Europe/Berlin]");
  }
  if (rest == "GPST" || rest == "GPS") return gps_from_calendar(c);
  if (rest.empty() || rest == "Z" || rest == "z" || rest == "UTC") return gps_from_utc(c);
  const bool east = take(rest, "+");
  if (!east && !take(rest, "-")) throw wrong;
  const int hours = number(2);
  const bool colon = take(rest, ":");
  const int minutes = colon || !rest.empty() ? number(2) : 0;
  if (!rest.empty() || hours > 14 || minutes > 59) throw wrong;
  // Shifts the calendar time before leap seconds are applied: half an hour after a UTC midnight with a leap
  // second the offset of the day before would be wrong, and "07:59:60+08:00" is a leap second.
  const auto offset = std::chrono::minutes(hours * 60 + minutes);
  return gps_from_utc(shifted(c, east ? -offset : offset));
}

std::string format_utc(GpsTime t, int decimals) {
  return format(utc_from_gps(t), decimals, "Z");
}

std::string format_gpst(GpsTime t, int decimals) {
  return format(calendar_from_gps(t), decimals, " GPST");
}

std::string rollover_text(GpsTime reported, GpsTime expected) {
  constexpr double kRollover_days = 1024 * 7, kNear_days = 8;
  const double days = (expected - reported) / 86'400;
  const double rollovers = std::round(days / kRollover_days);
  if (rollovers == 0 || std::abs(days - rollovers * kRollover_days) > kNear_days) return {};
  return fmt::format("; {:.0f} weeks {} it would be near: has a receiver's GPS week rolled over?",
                     std::abs(rollovers) * 1024, rollovers > 0 ? "later" : "earlier");
}

bool names_time_scale(std::string_view text) {
  constexpr std::string_view kDate = "2019-04-28";
  text = trim(text);
  return text.size() > kDate.size() && text.find_first_of("ZzUG+-", kDate.size()) != std::string_view::npos;
}

GpsTime parse_simulated_time(std::string_view text) {
  text = trim(text);
  const InputError out_of_range(fmt::format("the time '{}' is out of range", text),
                                "times run from 1980-01-06 to 2171-08-31, the GPS weeks 0 to 9999");
  // Checks the year before parse_time(), which has its own limits.
  const std::optional<long long> year = parse_integer(column(text, 0, 4));
  if (column(text, 4, 1) == "-" && year && (*year < 1980 || *year > 2171)) throw out_of_range;
  const GpsTime t = parse_time(text);
  if (t < GpsTime{} || t.week() > 9999) throw out_of_range;
  return t;
}

}  // namespace canyon::geodesy
