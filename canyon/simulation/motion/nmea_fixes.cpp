#include "canyon/simulation/motion/nmea_fixes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <vector>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"

namespace canyon::simulation {
namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;

constexpr std::string_view kDamaged = "damaged sentence (cut short, or with a wrong checksum)";

/// A sentence of NMEA 0183.
struct Sentence {
  std::vector<std::string_view> fields;  ///< the address first, such as GPGGA
  bool checked = false;                  ///< has a valid checksum

  [[nodiscard]] bool is(std::string_view type) const {
    return fields[0].size() == 5 && fields[0].substr(2) == type;
  }
  /// Empty if there is none; field 0 always is.
  [[nodiscard]] std::string_view field(std::size_t i) const {
    return i > 0 && i < fields.size() ? trim(fields[i]) : std::string_view();
  }
};

/// The text of a sentence before its checksum, if that is valid.
std::optional<std::string_view> checked_body(std::string_view text) {
  const auto digit = [](char c) {
    const char lower = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (lower >= '0' && lower <= '9') return static_cast<unsigned>(lower - '0');
    return lower >= 'a' && lower <= 'f' ? static_cast<unsigned>(lower - 'a') + 10 : 256U;
  };
  unsigned sum = 0;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] == '*' && at + 2 < text.size() && digit(text[at + 1]) * 16 + digit(text[at + 2]) == sum)
      return text.substr(0, at);
    sum ^= static_cast<unsigned char>(text[at]);
  }
  return std::nullopt;
}

/// Bytes of other protocols between sentences are not text.
bool is_text(std::string_view bytes) {
  const auto printable = std::count_if(bytes.begin(), bytes.end(), [](unsigned char c) {
    return std::isprint(c) != 0 || c == '\r' || c == '\t';
  });
  return 4 * static_cast<std::size_t>(printable) > 3 * bytes.size();
}

/// Calls `each` for the sentences of a line: a logger may write its own text before and after them, or join
/// several. Returns the number of damaged ones: with a wrong checksum, or cut by the next sentence.
std::size_t each_sentence(std::string_view line, const std::function<void(const Sentence&)>& each) {
  std::size_t damaged = 0;
  for (std::size_t at = line.find('$'); at != std::string_view::npos;) {
    const std::size_t next = line.find('$', at + 1);
    const std::string_view text = line.substr(at + 1, next - at - 1);
    if (const auto body = checked_body(text)) {
      each(Sentence{split(*body, ','), true});
    } else if (is_text(text)) {
      const bool ended = next != std::string_view::npos || text.find('*') != std::string_view::npos;
      if (ended)
        ++damaged;
      else
        each(Sentence{split(trim(text), ','), false});
    }
    at = next;
  }
  return damaged;
}

/// A sentence type with a position, and the indices of its fields; 0: it has no such field.
struct PositionKind {
  std::string_view name;
  std::size_t fields, time, latitude, status, mode, altitude, separation;
};
constexpr std::size_t kKinds = 4;
constexpr std::array<PositionKind, kKinds> kPositionKinds{{{"GGA", 12, 1, 2, 0, 0, 9, 11},
                                                           {"GNS", 11, 1, 2, 0, 6, 9, 10},
                                                           {"RMC", 10, 1, 3, 2, 12, 0, 0},
                                                           {"GLL", 7, 5, 1, 6, 7, 0, 0}}};

/// A position, or a date.
struct Report {
  int line = 0;
  bool checked = false;
  std::int64_t time_of_day_ns = 0;
  std::optional<GpsTime> date;  ///< midnight before it; only for a date
  std::size_t kind = 0;         ///< of a position
  Geodetic position;            ///< its height is not set
  std::optional<double> altitude_m, separation_m;
};

double nmea_angle_deg(const RecordAt& at, std::string_view text, std::string_view side,
                      std::string_view sides, double limit_deg, std::string_view what) {
  const double value = to_number(at, text, what);
  const double degrees = std::trunc(value / 100), minutes = value - 100 * degrees;
  // At least one digit of degrees: 48.1 deg is not 0 deg 48.1'.
  const bool no_degrees = value != 0 && text.find('.') < 3;
  if (value < 0 || minutes >= 60 || degrees + minutes / 60 > limit_deg || no_degrees) {
    throw at.error(fmt::format("the {} '{}' is not ddmm.mmmm", what, text),
                   "NMEA has degrees and minutes in one number: 4807.038 is 48 deg 7.038'");
  }
  if (side.size() != 1 || sides.find(side[0]) == std::string_view::npos) {
    throw at.error(fmt::format("the {}'s side '{}' is neither {} nor {}", what, side, sides[0], sides[1]),
                   "a decimal comma makes two fields of one: write points");
  }
  return side[0] == sides[0] ? degrees + minutes / 60 : -(degrees + minutes / 60);
}

/// hhmmss.sss as nanoseconds of the UTC day (a leap second's 235960 gives 24 h).
std::int64_t time_of_day_ns(const RecordAt& at, std::string_view text) {
  const auto hour = parse_integer(column(text, 0, 2));
  const auto minute = parse_integer(column(text, 2, 2));
  const auto second = parse_double(column(text, 4, text.size()));
  const bool digits =
      std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) || c == '.'; });
  if (!digits || !hour || !minute || !second || *hour > 23 || *minute > 59 || *second >= 61)
    throw at.error(fmt::format("the time '{}' is not hhmmss.ss", text));
  return (*hour * 3600 + *minute * 60) * GpsTime::kNanosecondsPerSecond + std::llround(*second * 1e9);
}

/// RMC's and GLL's status and mode.
bool is_void(std::string_view status, std::string_view mode) {
  return (status != "A" && status != "D") || mode == "N";
}

bool has_fix(const RecordAt& at, const PositionKind& kind, const Sentence& sentence) {
  if (kind.status != 0) return !is_void(sentence.field(kind.status), sentence.field(kind.mode));
  if (kind.mode != 0) return sentence.field(kind.mode).find_first_not_of('N') != std::string_view::npos;
  const std::string_view quality = sentence.field(6);
  const auto number = parse_integer(quality);
  if (!number && !quality.empty())
    throw at.error(fmt::format("the quality '{}' is not a number", quality), "GGA has 0 to 8");
  return number.value_or(0) != 0;
}

/// Empty without a fix.
std::optional<Report> read_position(const RecordAt& at, std::size_t kind, const Sentence& sentence) {
  const PositionKind& of = kPositionKinds[kind];
  const std::string_view time = sentence.field(of.time), latitude = sentence.field(of.latitude);
  if (!has_fix(at, of, sentence) || time.empty() || latitude.empty()) return std::nullopt;
  Report report;
  report.line = at.line;
  report.checked = sentence.checked;
  report.kind = kind;
  report.position =
      position_of(at, nmea_angle_deg(at, latitude, sentence.field(of.latitude + 1), "NS", 90, "latitude"),
                  nmea_angle_deg(at, sentence.field(of.latitude + 2), sentence.field(of.latitude + 3), "EW",
                                 180, "longitude"));
  report.time_of_day_ns = time_of_day_ns(at, time);
  for (const std::size_t unit : {std::size_t{10}, std::size_t{12}}) {
    if (of.name != "GGA" || sentence.field(unit).empty() || lower_case(sentence.field(unit)) == "m") continue;
    throw at.error(fmt::format("the unit '{}' of a height is not M", sentence.field(unit)), "GGA has metres");
  }
  const std::string_view altitude = sentence.field(of.altitude), geoid = sentence.field(of.separation);
  if (!is_missing(altitude)) report.altitude_m = to_number(at, altitude, "altitude");
  if (!is_missing(geoid)) report.separation_m = to_number(at, geoid, "geoid separation");
  return report;
}

GpsTime midnight_of(int year, int month, int day) {
  geodesy::CalendarTime midnight;
  midnight.year = year;
  midnight.month = month;
  midnight.day = day;
  return geodesy::gps_from_utc(midnight);
}
GpsTime midnight_of(GpsTime t) {
  const geodesy::CalendarTime date = geodesy::utc_from_gps(t);
  return midnight_of(date.year, date.month, date.day);
}

/// The date of a valid RMC, or of a ZDA. An invalid RMC may have a wrong date, from before the first fix.
std::optional<Report> read_date(const RecordAt& at, const Sentence& sentence) {
  std::array<std::string_view, 3> text;  // day, month, year
  if (sentence.is("RMC")) {
    const std::string_view date = sentence.field(9);
    if (is_void(sentence.field(2), sentence.field(12)) || date.size() != 6) return std::nullopt;
    text = {date.substr(0, 2), date.substr(2, 2), date.substr(4, 2)};
  } else if (sentence.is("ZDA") && !sentence.field(4).empty()) {
    text = {sentence.field(2), sentence.field(3), sentence.field(4)};
  } else {
    return std::nullopt;
  }
  if (sentence.field(1).empty()) return std::nullopt;
  std::array<int, 3> value{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto number = parse_integer(text[k]);
    if (!number || *number < 0 || *number > 9999)
      throw at.error(fmt::format("the date '{}' is not day, month, year", text[k]));
    value[k] = static_cast<int>(*number);
  }
  if (sentence.is("RMC")) value[2] += value[2] < 70 ? 2000 : 1900;
  // The date of clocks that were never set, with one day of tolerance.
  if (value[2] < 1981) value = {1, 6, 1980};
  Report report;
  report.line = at.line;
  report.checked = sentence.checked;
  report.time_of_day_ns = time_of_day_ns(at, sentence.field(1));
  try {
    report.date = midnight_of(value[2], value[1], value[0]);
  } catch (const InputError& e) {
    throw at.error(e.problem(), e.hint());
  }
  return report;
}

/// The reports of a log in its order.
class NmeaLog {
 public:
  explicit NmeaLog(const std::filesystem::path& path) : report(path) {
    TextFile file(path);
    while (const auto line = file.next_line()) {
      const RecordAt at{report, file.line()};
      std::size_t damaged = each_sentence(*line, [&](const Sentence& sentence) { take(at, sentence); });
      for (; damaged > 0; --damaged) at.report.drop(at.line, kDamaged);
      if (line->find("\xB5\x62\x02\x15") != std::string_view::npos) {
        report.add_line(ReadReport::Level::Remark,
                        "UBX-RXM-RAWX between the sentences is not read: RTKLIB's convbin -r ubx makes RINEX "
                        "observations");
      }
    }
    if (zda_) reports.push_back(*zda_);
    const auto is_checked = [](const Report& r) { return r.checked; };
    // If sentences have checksums, one without is cut short: its last number may be too.
    if (std::any_of(reports.begin(), reports.end(), is_checked)) {
      std::erase_if(reports, [&](const Report& r) {
        if (!r.checked) report.drop(r.line, kDamaged);
        return !r.checked;
      });
    }
    choose_kind();
  }

  std::vector<Report> reports;  ///< dates, and positions of one kind
  std::size_t kind = 0;
  ReadReport report;

 private:
  void take(const RecordAt& at, const Sentence& sentence) {
    guard_record(report, [&] {
      const auto date = read_date(at, sentence);
      if (date && sentence.is("RMC")) reports.push_back(*date);
      if (date && sentence.is("ZDA")) zda_ = date;
    });
    for (std::size_t k = 0; k < kKinds; ++k) {
      if (!sentence.is(kPositionKinds[k].name)) continue;
      if (sentence.fields.size() < kPositionKinds[k].fields) return at.report.drop(at.line, kDamaged);
      guard_record(report, [&] {
        const auto position = read_position(at, k, sentence);
        if (position && zda_) reports.push_back(*zda_);
        if (position || k < 2) zda_.reset();
        if (position) reports.push_back(*position);
        if (!position && k == 0) report.remark(at.line, "GGA sentence without a fix", "left out");
      });
    }
  }

  /// Chooses the kind with altitudes and more positions, else one without.
  void choose_kind() {
    std::array<std::size_t, kKinds> counts{};
    for (const Report& each : reports)
      if (!each.date) ++counts[each.kind];
    kind = counts[1] > counts[0] ? 1 : 0;
    if (counts[kind] == 0) kind = counts[2] > 0 ? 2 : 3;
    std::erase_if(reports, [&](const Report& r) { return !r.date && r.kind != kind; });
  }

  std::optional<Report> zda_;  ///< before the next position; may be wrong without a fix
};

/// The instant with this time of day nearest to `near`.
GpsTime closest(std::int64_t time_of_day_ns, GpsTime near) {
  const GpsTime midnight = midnight_of(near);
  GpsTime best = midnight + std::chrono::nanoseconds(time_of_day_ns);
  for (const int hours : {-12, 36}) {
    const GpsTime other =
        midnight_of(midnight + std::chrono::hours(hours)) + std::chrono::nanoseconds(time_of_day_ns);
    if (std::abs(other - near) < std::abs(best - near)) best = other;
  }
  return best;
}

}  // namespace

RecordedPath read_nmea(const std::filesystem::path& path, GpsTime start, const HeightReading& heights) {
  NmeaLog log(path);
  RecordedPath result;
  const auto instant = [](const Report& date) {
    return *date.date + std::chrono::nanoseconds(date.time_of_day_ns);
  };
  const auto first = std::find_if(log.reports.begin(), log.reports.end(),
                                  [](const Report& report) { return report.date.has_value(); });
  result.is_dated = first != log.reports.end();
  std::size_t flat = 0;
  std::optional<GpsTime> last;
  if (result.is_dated) last = instant(*first);
  double height_m = 0;
  for (const Report& report : log.reports) {
    if (report.date) {
      last = instant(report);
      continue;
    }
    const RecordAt at{log.report, report.line};
    if (!result.is_dated && start == GpsTime{}) {
      throw at.error("no RMC or ZDA sentence has the date of a fix, and the scenario has no start",
                     "add 'start: 2026-01-01T12:00:00Z' to the scenario");
    }
    // The first position of a log without dates is on the start's day.
    last = last ? closest(report.time_of_day_ns, *last)
                : midnight_of(start) + std::chrono::nanoseconds(report.time_of_day_ns);
    Geodetic position = report.position;
    if (!report.altitude_m) {
      ++flat;
      if (heights.needed) {
        at.report.drop(at.line, "fix without an altitude", "left out; optional with height_above_terrain_m");
        continue;
      }
      at.report.guess(at.line, "fix without an altitude", "its position is used");
    } else if (report.separation_m) {
      height_m = *report.altitude_m + *report.separation_m;
    } else {
      height_m = from_sea_level(at, *report.altitude_m, "altitude without a geoid separation", heights);
    }
    position.height_m = height_m;
    guard_record(log.report, [&] { result.points.push_back({set_time(at, *last), position, report.line}); });
  }
  if (result.points.empty() && flat > 0) {
    throw InputError(path, 0, fmt::format("none of its {} fixes has an altitude", flat),
                     "give trajectory.height_above_terrain_m");
  }
  log.report.require_majority(result.points.size());
  if (result.points.empty()) {
    throw InputError(path, 0, "no GGA, GNS, RMC or GLL sentence with a fix",
                     "expected lines like $GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47");
  }
  result.report = std::move(log.report);
  return result;
}

std::optional<Geodetic> position_of_gga(std::string_view line) {
  std::optional<Geodetic> position;
  ReadReport ignored;
  const RecordAt at{ignored, 0};
  (void)each_sentence(line, [&](const Sentence& sentence) {
    if (position || !sentence.is("GGA") || sentence.fields.size() < kPositionKinds[0].fields) return;
    ignored.guard([&] {
      const auto report = read_position(at, 0, sentence);
      if (!report || !report->altitude_m) return;
      position = report->position;
      position->height_m = *report->altitude_m + report->separation_m.value_or(0);
    });
  });
  return position;
}

}  // namespace canyon::simulation
