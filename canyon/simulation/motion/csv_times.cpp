#include "canyon/simulation/motion/csv_times.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <utility>

#include "canyon/base/text.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/geodesy/time_text.hpp"
#include "canyon/simulation/motion/column_points.hpp"

namespace canyon::simulation {
namespace {

using geodesy::GpsTime;

/// 2000 and 2100 as Unix times [s]: times of one in ms, us or ns lie in none of the others.
constexpr double kYear2000_s = 9.46e8, kYear2100_s = 4.1e9;
struct UnixUnit {
  double s;
  std::string_view name;
};
constexpr std::array<UnixUnit, 4> kUnixUnits{
    {{1, "seconds"}, {1e-3, "milliseconds"}, {1e-6, "microseconds"}, {1e-9, "nanoseconds"}}};

/// Garmin's FIT counts from 1989-12-31; until 2037 its seconds are below those of Unix times of today.
constexpr double kFitEpochUnix_s = 631'065'600, kLatestFit_s = 1.5e9;

}  // namespace

std::string iso_date(std::string_view text) {
  std::string date(trim(text));
  std::replace(date.begin(), date.end(), '/', '-');
  if (date.size() == 8 && parse_integer(date))
    date = date.substr(0, 4) + "-" + date.substr(4, 2) + "-" + date.substr(6);
  return date.size() == 10 && date[4] == '-' && date[7] == '-' ? date : std::string();
}

GpsTime CsvTimes::read(const std::vector<std::string_view>& fields) {
  const std::string_view text = fields[columns_.time.index];
  const auto [kind, time] = kind_and_time(fields, text);
  kind_ = kind;
  return time;
}

std::pair<CsvTimes::Kind, GpsTime> CsvTimes::kind_and_time(const std::vector<std::string_view>& fields,
                                                           std::string_view text) {
  if (const auto time = of_week(fields)) return {require_kind(Kind::Weeks, text), *time};
  const bool has_date = !iso_date(text.substr(0, 10)).empty();
  if (columns_.date && !has_date) return {kind_, dated(on_date(fields[*columns_.date], text))};
  const std::optional<double> number = field_number(text);
  if (number && columns_.fit && *number > 0 && *number < kLatestFit_s) {
    if (kind_ != Kind::Unix) notes_.say(file_.line(), "times are taken as seconds since 1989-12-31 (FIT)");
    return {require_kind(Kind::Unix, text), from_unix(kFitEpochUnix_s + *number, text)};
  }
  if (!number) return {require_kind(Kind::Dates, text), dated(std::string(text))};
  if (columns_.clock == CsvClock::GpsEpoch) {
    constexpr double kWeek9999_s = 1e4 * 604'800;
    const double seconds = *number * columns_.time.scale;
    if (!(seconds >= 0 && seconds < kWeek9999_s))
      throw file_.error(fmt::format("the time '{}' is not milliseconds since 1980-01-06", text));
    return {require_kind(Kind::Unix, text), GpsTime::from_nanoseconds(std::llround(seconds * 1e9))};
  }
  if (columns_.clock == CsvClock::Unix)
    return {require_kind(Kind::Unix, text), from_unix(*number * columns_.time.scale, text)};
  if (const auto unit_s = unix_unit_s(*number)) {
    const Kind kind = require_kind(Kind::Unix, text);
    if (!unix_unit_s_) note_unix(*unit_s, text);
    unix_unit_s_ = unit_s;
    return {kind, from_unix(*number * *unit_s, text)};
  }
  const Kind kind = require_kind(Kind::FromStart, text);
  return {kind, from_start(*number * columns_.time.scale, text)};
}

void CsvTimes::note_unix(double unit_s, std::string_view text) const {
  const auto* const unit = std::find_if(kUnixUnits.begin(), kUnixUnits.end(),
                                        [unit_s](const UnixUnit& each) { return each.s == unit_s; });
  notes_.say(file_.line(), fmt::format("times such as {} are taken as Unix times in {}", text, unit->name));
}

void CsvTimes::note_late_start() const {
  constexpr double kLate_s = 600;
  if (!relative() || !first_s_ || *first_s_ < kLate_s) return;
  notes_.say(
      0,
      fmt::format("times are taken as seconds from the scenario's start, and the first is {:g} s", *first_s_),
      "seconds of the GPS week need a column 'week' beside them, times of day a column 'date'");
}

void CsvTimes::check_steps() const {
  if (!relative() || columns_.time.unit || count_ < 3) return;
  const double step_s = std::abs(last_s_ - *first_s_) / static_cast<double>(count_ - 1);
  constexpr double kNever_s = 10'000;
  if (step_s < kNever_s) return;
  throw InputError(
      file_.path(), 0,
      fmt::format("times are taken as seconds, and points are {:.4g} s apart on average", step_s),
      "name the column by the unit that it has: time_s, time_ms, time_us, time_ns");
}

CsvTimes::Kind CsvTimes::require_kind(Kind kind, std::string_view text) const {
  if (kind_ == Kind::Unknown || kind_ == kind) return kind;
  throw file_.error(fmt::format("the time '{}' is written in another way than above", text),
                    "use seconds from the start or ISO 8601 throughout");
}

std::string CsvTimes::on_date(std::string_view date_text, std::string_view time_text) const {
  const std::string date = iso_date(date_text);
  std::string time(trim(time_text));
  const bool digits = time.size() >= 6 && std::all_of(time.begin(), time.begin() + 6,
                                                      [](unsigned char c) { return std::isdigit(c) != 0; });
  if (digits) time = time.substr(0, 2) + ":" + time.substr(2, 2) + ":" + time.substr(4);
  if (date.empty() || time.find(':') == std::string::npos) {
    throw file_.error(
        fmt::format("the date '{}' and the time '{}' are not known forms", date_text, time_text),
        "write 2024-05-01 and 12:00:00 in columns 'date' and 'time', or one column of ISO 8601");
  }
  return date + "T" + time;
}

std::optional<GpsTime> CsvTimes::of_week(const std::vector<std::string_view>& fields) const {
  const std::string_view text = fields[columns_.time.index];
  // RTKLIB writes both under one name.
  const std::vector<std::string_view> words = split_blanks(text);
  if (words.size() == 2 && parse_integer(words[0]) && field_number(words[1]))
    return time_of_week(file_, words[0], to_number(file_, words[1], "time of week"));
  if (!columns_.week) return std::nullopt;
  const std::optional<double> seconds = field_number(text);
  if (!seconds) return std::nullopt;
  const double tow_s = *seconds * columns_.time.scale;
  // A column 'time' beside the week may still have Unix times.
  if (!columns_.time_of_week && !(tow_s >= 0 && tow_s < static_cast<double>(GpsTime::kSecondsPerWeek)))
    return std::nullopt;
  return time_of_week(file_, fields[*columns_.week], tow_s);
}

GpsTime CsvTimes::from_unix(double seconds, std::string_view text) const {
  if (!(seconds > 0 && seconds < kYear2100_s)) {
    throw file_.error(fmt::format("the time '{}' in column '{}' is not a Unix time of 1970 to 2100", text,
                                  columns_.time.name),
                      "name the column by the unit that it has: unix_time_s, unix_time_ms, _us, _ns");
  }
  return geodesy::gps_from_unix(std::llround(seconds * 1e9));
}

std::optional<double> CsvTimes::unix_unit_s(double value) const {
  if (kind_ == Kind::FromStart || columns_.clock == CsvClock::Gps) return std::nullopt;
  if (unix_unit_s_) return unix_unit_s_;
  for (const UnixUnit& unit : kUnixUnits) {
    const double seconds = value * unit.s;
    if (seconds >= kYear2000_s && seconds < kYear2100_s &&
        (!columns_.time.unit || columns_.time.scale == unit.s))
      return unit.s;
  }
  return std::nullopt;
}

GpsTime CsvTimes::from_start(double seconds, std::string_view text) {
  if (columns_.clock != CsvClock::Unsaid) {
    throw file_.error(
        fmt::format("the time '{}' in column '{}' is neither seconds from the start nor ISO 8601", text,
                    columns_.time.name),
        "write ISO 8601 times, or rename the column time_s: seconds from the scenario's start");
  }
  if (start_ == GpsTime{}) {
    throw file_.error("times are seconds from the start, and the scenario has no start",
                      "add 'start: 2026-01-01T12:00:00Z' to the scenario, or write ISO 8601 times");
  }
  if (std::abs(seconds) > 1e7) {
    throw file_.error(
        fmt::format("the time {} s is out of range", text),
        "times are seconds from the scenario's start, or ISO 8601; name the column by the unit that it has: "
        "time_s, time_ms, time_us, time_ns");
  }
  if (!first_s_) first_s_ = seconds;
  last_s_ = seconds;
  ++count_;
  return start_ + seconds;
}

GpsTime CsvTimes::dated(std::string text) {
  const std::vector<std::string_view> words = split_blanks(text);
  if (const std::string date = words.empty() ? std::string() : iso_date(words[0]); !date.empty())
    text = fmt::format("{} {}", date, fmt::join(words.begin() + 1, words.end(), " "));
  if (!geodesy::names_time_scale(text)) {
    if (columns_.clock == CsvClock::Gps) {
      text += " GPST";
    } else if (columns_.clock == CsvClock::Jst) {
      text += "+09:00";
    } else if (columns_.clock == CsvClock::Unsaid && !std::exchange(warned_, true)) {
      notes_.say(file_.error(fmt::format("the time {} names no zone", text), "such times are taken as UTC"));
    }
  }
  try {
    return geodesy::parse_simulated_time(text);
  } catch (const InputError& e) {
    bool written = true;
    try {
      (void)geodesy::parse_time(text);
    } catch (const InputError&) {
      written = false;
    }
    throw file_.error(
        written ? e.problem() : fmt::format("the time '{}' is neither a number nor ISO 8601", text),
        e.cure().empty() ? e.problem() : e.cure());
  }
}

}  // namespace canyon::simulation
