#include "canyon/simulation/motion/csv_track.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/text.hpp"

namespace canyon::simulation {
namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;
using Fields = std::vector<std::string_view>;

struct Unit {
  std::string_view name;
  double scale;
};
constexpr std::array<Unit, 3> kAngles{{{"deg", 1}, {"rad", geodesy::kDegreesPerRadian}, {"e7", 1e-7}}};
constexpr std::array<Unit, 5> kLengths{{{"m", 1}, {"km", 1000}, {"cm", 0.01}, {"mm", 1e-3}, {"ft", 0.3048}}};
constexpr std::array<Unit, 4> kTimes{{{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}}};

enum Quantity : std::size_t {
  Time,
  UnixTime,
  Week,
  Cycle,
  Tow,
  Latitude,
  Longitude,
  Height,
  HeightMsl,
  X,
  Y,
  Z
};
struct Row {
  std::string_view name, other_names;
  std::span<const Unit> units;  ///< the first one applies to the bare name
  std::string_view help;        ///< of trajectory.columns
};
constexpr std::size_t kQuantities = 12;
const std::array<Row, kQuantities> kRows{
    {{"time", "", kTimes,
      "name of the CSV column of the time: ISO 8601, or with a unit, such as 'stamp [ms]', counted from "
      "start"},
     {"unix_time", "", kTimes, "of the time since 1970, with its unit: s, ms, us, ns"},
     {"gps_week", "", {}, "of the full GPS week, with gps_tow"},
     {"gps_cycle", "", {}, "of the cycles of 1,024 weeks that gps_week lacks"},
     {"gps_tow", "", kTimes, "of the time of week, with its unit: s, ms"},
     {"latitude", "lat", kAngles,
      "of the latitude, with its unit: deg, rad, e7, as in 'lat [rad]' or lat_deg"},
     {"longitude", "lon long", kAngles, "of the longitude, likewise"},
     {"height", "", kLengths, "of the ellipsoidal height, with its unit: m, km, cm, mm, ft"},
     {"height_msl", "", kLengths, "of a height above sea level instead"},
     {"x", "pos_x", kLengths, "of ECEF x instead of latitude, longitude and height, with its unit"},
     {"y", "pos_y", kLengths, "of ECEF y"},
     {"z", "pos_z", kLengths, "of ECEF z"}}};

struct Column {
  std::size_t index = 0;
  std::string name;
  double scale = 1;   ///< to degrees, metres or seconds
  bool unit = false;  ///< the name has a unit
};
using Columns = std::array<std::optional<Column>, kQuantities>;

/// Splits a name and its unit: "lat [rad]", "lat (rad)" and "lat_rad" have "rad".
std::pair<std::string, const Unit*> parted(std::string_view text, std::span<const Unit> units) {
  const std::string name = lower_case(trim(text));
  if (name.empty()) return {name, nullptr};
  const bool brackets = name.back() == ']' || name.back() == ')';
  const std::size_t at = name.find_last_of(brackets ? "[(" : "_");
  if (at == std::string::npos) return {name, nullptr};
  const std::string_view word =
      trim(std::string_view(name).substr(at + 1, name.size() - at - 1 - (brackets ? 1 : 0)));
  for (const Unit& unit : units)
    if (unit.name == word) return {std::string(trim(name.substr(0, at))), &unit};
  return {name, nullptr};
}

/// Names of the time's column in other programs.
constexpr std::string_view kTimeNames = "time timestamp stamp datetime date utc utctime gpstime t";

bool has_word(std::string_view words, std::string_view word) {
  const auto all = split_blanks(words);
  return std::find(all.begin(), all.end(), word) != all.end();
}

/// A name in lower case with words joined by '_': GpsWeek is gps_week.
std::string plain(std::string_view name) {
  std::string text = lower_case(name);
  std::erase_if(text, [](char c) { return c == '_' || c == ' '; });
  return text;
}

/// Fields of a line by RFC 4180, without surrounding blanks and quotes.
Fields csv_fields(std::string_view line, char separator) {
  if (separator == ' ') return split_blanks(line);
  Fields fields;
  bool quoted = false;
  std::size_t begin = 0;
  for (std::size_t at = 0; at <= line.size(); ++at) {
    if (at < line.size() && line[at] == '"') quoted = !quoted;
    if (at < line.size() && (quoted || line[at] != separator)) continue;
    std::string_view field = trim(line.substr(begin, at - begin));
    if (field.size() >= 2 && field.front() == '"' && field.back() == '"')
      field = trim(field.substr(1, field.size() - 2));
    fields.push_back(field);
    begin = at + 1;
  }
  return fields;
}

constexpr std::string_view kCommentMarks = "#%";

bool is_skipped(std::string_view line, std::string_view marks = kCommentMarks) {
  line = trim(line);
  return line.empty() || marks.find(line.front()) != std::string_view::npos;
}

/// The text of a comment, or of another line.
std::string_view without_mark(std::string_view line) {
  const std::size_t at = line.find_first_not_of(" \t#%");
  return is_skipped(line) ? line.substr(std::min(at, line.size())) : line;
}

/// Semicolons or tabs if any: commas may then be decimal points; blanks if there is no other separator.
char separator_of(std::string_view line) {
  for (const char separator : {';', '\t', ','})
    if (line.find(separator) != std::string_view::npos) return separator;
  return ' ';
}

class CsvReader {
 public:
  CsvReader(TextFile& file, GpsTime start, const HeightReading& heights)
      : file_(file), start_(start), heights_(heights) {
    path_.report = ReadReport(file.path());
  }

  RecordedPath read(const TrajectoryColumns& columns) {
    given_ = &columns;
    numbers_ = !columns.empty() && std::all_of(columns.begin(), columns.end(), [](const auto& column) {
      return parse_integer(split(column.second, '[')[0]).has_value();
    });
    find_header();
    if (!header_) throw InputError(file_.path(), 0, "no position in it", columns_hint());
    take_header(*header_);
    if (numbers_) file_.unread_line();
    int first_record = 0;  // line of the first record
    while (const auto line = file_.next_line()) {
      // Not a record: a comment, or another header.
      const auto names = [&] { return !numbers_ && names_columns(*line); };
      bool other = is_skipped(*line) || (first_record == 0 && names());
      if (!other && separator_ == '\0') separator_ = separator_of(*line);
      Fields fields = csv_fields(*line, separator_);
      if (!other && first_record == 0) {
        require_numbers(fields);
        first_record = file_.line();
      }
      if (!other) {
        guard_record(path_.report, [&] {
          try {
            read_record(fields);
          } catch (const InputError&) {
            if (!(other = names())) throw;
          }
        });
      }
      if (other) take_another_header(*line);
    }
    path_.report.require_majority(path_.points.size());
    note_doubts();
    if (path_.points.empty())
      throw InputError(file_.path(), first_record, "no line has a time, a position and a height",
                       columns_hint());
    return std::move(path_);
  }

 private:
  /// Whether a line names columns: all given ones, or else two of Canyon's own names; three if only blanks
  /// separate them, since a sentence may contain two.
  [[nodiscard]] bool names_columns(std::string_view line) const {
    const char separator = separator_of(line);
    const Fields fields = csv_fields(line, separator);
    if (!given_->empty()) {
      return std::all_of(given_->begin(), given_->end(), [&](const auto& column) {
        const std::size_t at = index_of(fields, column.second, numbers_);
        return at < fields.size() && (!numbers_ || column.first == "time" || number_of(fields[at]));
      });
    }
    return std::count_if(fields.begin(), fields.end(), [](auto name) {
             return known(name).first < kQuantities;
           }) > (separator == ' ' ? 2 : 1);
  }

  /// Goes to the header: the first line that names columns, or a comment above the first record that does.
  /// Else it is the first line, or the last comment above, if that has as many fields as the record.
  void find_header() {
    constexpr int kMaxTexts = 100;
    TextFile ahead = TextFile::streamed(file_.path());
    int header = 0;
    std::size_t count = 0;  // of the fields of a comment
    bool named = false, started = false;
    for (auto line = ahead.next_line(); line && (!started || ahead.line() <= kMaxTexts);
         line = ahead.next_line()) {
      const std::string_view text = without_mark(*line);
      const Fields fields = csv_fields(text, separator_of(text));
      const bool comment = is_skipped(*line), names = names_columns(text);
      if (!comment && names) header = ahead.line();
      if (!comment && names) break;
      if (started || named || trim(text).empty()) {
        if (!comment && named) break;
        continue;
      }
      started = !comment;
      named = names && !numbers_;
      const auto number = [](std::string_view field) { return number_of(field).has_value(); };
      if (started && !numbers_ && count == fields.size() && std::any_of(fields.begin(), fields.end(), number))
        continue;
      header = ahead.line();
      count = comment ? fields.size() : 0;
    }
    while (file_.line() < header) header_ = file_.next_line();
  }

  /// Sets the columns from a header line.
  void take_header(std::string_view line) {
    const std::string_view text = without_mark(line);
    const Fields header = csv_fields(text, separator_of(text));
    // Numbers below Matlab's comment may have another separator.
    separator_ = is_skipped(line) ? '\0' : separator_of(text);
    count_ = header.size();
    columns_ = {};
    undecided_ = true;
    if (given_->empty()) {
      require_header(header);
      find_known(header);
    } else {
      for (const auto& [quantity, name] : *given_) find_named(header, quantity, name, numbers_);
    }
    check(header);
  }

  /// Sets the columns from another header further down, as in concatenated files; a comment may be one.
  void take_another_header(std::string_view line) {
    const std::string_view text = without_mark(line);
    if (numbers_ || !names_columns(text)) return;
    if (is_skipped(line) && csv_fields(text, separator_of(text)).size() != count_) return;
    path_.report.guess(file_.line(), "another header", "its columns apply from there on");
    take_header(line);
  }

  /// Index of a column of trajectory.columns; beyond the end: missing.
  static std::size_t index_of(const Fields& header, std::string_view given, bool numbers) {
    const std::string_view name = trim(given.substr(0, given.find_last_of('[')));
    if (numbers) return static_cast<std::size_t>(*parse_integer(name)) - 1;
    auto at = std::find(header.begin(), header.end(), without_mark(trim(given)));
    if (at == header.end()) at = std::find(header.begin(), header.end(), without_mark(name));
    return static_cast<std::size_t>(at - header.begin());
  }

  /// Rejects a file that begins with numbers, with a guess of its columns.
  void require_header(const Fields& first) const {
    std::vector<double> values;
    for (const std::string_view text : first) values.push_back(number_of(text).value_or(std::nan("")));
    if (std::any_of(values.begin(), values.end(), [](double value) { return std::isnan(value); })) return;
    const std::size_t n = values.size();
    const bool ecef = n > 3 && is_radius(std::hypot(values[n - 3], values[n - 2], values[n - 1]));
    throw file_.error(
        fmt::format("has no header: its first line is the numbers '{}'{}", fmt::join(first, "', '"),
                    ecef ? ", which look like ECEF x, y, z in metres" : ""),
        ecef ? fmt::format(
                   "put a header time,x,y,z above them, or give trajectory.columns: {{time: \"{} [s]\", x: "
                   "\"{} [m]\", y: \"{} [m]\", z: \"{} [m]\"}}",
                   n - 3, n - 2, n - 1, n)
             : std::string(
                   "put a header such as time,latitude,longitude,height above them, or give the columns "
                   "by number: trajectory.columns: {time: \"1 [s]\", latitude: \"2 [deg]\", longitude: "
                   "\"3 [deg]\", height: \"4 [m]\"}"));
  }

  /// The quantity of one of Canyon's own column names, and its unit; kQuantities: none.
  static std::pair<std::size_t, const Unit*> known(std::string_view name) {
    for (std::size_t q = 0; q < kQuantities; ++q) {
      const auto [base, unit] = parted(name, kRows[q].units);
      if (!base.empty() && (plain(base) == plain(kRows[q].name) || has_word(kRows[q].other_names, base)))
        return {q, unit};
    }
    return {kQuantities, nullptr};
  }

  /// Finds the columns with Canyon's own names. In its epochs.csv the path is the true one.
  void find_known(const Fields& header) {
    const bool truth = std::any_of(header.begin(), header.end(), [](std::string_view name) {
      return lower_case(name) == "true_latitude_deg";
    });
    for (std::size_t i = 0; i < header.size(); ++i) {
      std::string name = lower_case(header[i]);
      if (truth && name.starts_with("true_")) name.erase(0, 5);
      const auto [q, unit] = known(name);
      if (q == kQuantities) continue;
      if (columns_[q]) {
        throw file_.error(fmt::format("the columns '{}' and '{}' are both the {}", columns_[q]->name,
                                      header[i], kRows[q].name),
                          columns_hint());
      }
      columns_[q] = Column{i, std::string(header[i]), unit ? unit->scale : 1, unit != nullptr};
    }
  }

  /// Finds the column that trajectory.columns names for a quantity.
  void find_named(const Fields& header, std::string_view quantity, const std::string& given, bool numbers) {
    const auto* const row =
        std::find_if(kRows.begin(), kRows.end(), [&](const Row& r) { return r.name == quantity; });
    const auto fault = [&](std::string_view problem) {
      return file_.error(fmt::format("trajectory.columns.{}: {}", quantity, problem), columns_hint());
    };
    const std::size_t index = index_of(header, given, numbers);
    if (index >= header.size())
      throw fault(fmt::format("no column '{}'; there are '{}'", given, fmt::join(header, "', '")));
    const Unit* unit = parted(given, row->units).second;
    const auto q = static_cast<std::size_t>(row - kRows.begin());
    // A time without a unit is a date with its time.
    if (unit == nullptr && q != Time && !row->units.empty()) {
      std::vector<std::string_view> units;
      for (const Unit& each : row->units) units.push_back(each.name);
      throw fault(fmt::format("the unit of '{}' is missing; write '{} [{}]', or {}", given, given,
                              units.front(), fmt::join(units.begin() + 1, units.end(), ", ")));
    }
    columns_[q] = Column{index, given, unit ? unit->scale : 1, unit != nullptr};
    dates_ = dates_ || (q == Time && unit == nullptr);
  }

  /// One time and one position are required.
  void check(const Fields& header) {
    weeks_ = columns_[Week] && columns_[Tow];
    ecef_ = columns_[X] && columns_[Y] && columns_[Z];
    // If there are angles without a unit and ECEF columns, ECEF is used; the first record decides.
    doubtful_ = (doubtful_ || path_.points.empty()) && columns_[Latitude] && !columns_[Latitude]->unit;
    if (columns_[Latitude] && !doubtful_) ecef_ = false;
    const auto require = [&](bool has, const char* what) {
      if (has) return;
      throw file_.error(fmt::format("no column '{}'; there are '{}'", what, fmt::join(header, "', '")),
                        hint_for(header));
    };
    path_.timed = weeks_ || columns_[UnixTime] || columns_[Time];
    // A file of positions only, unless its times have another name.
    require(path_.timed || std::none_of(header.begin(), header.end(),
                                        [](auto name) {
                                          return has_word(kTimeNames, plain(parted(name, kTimes).first));
                                        }),
            "time");
    require(ecef_ || columns_[Latitude].has_value(), "latitude");
    require(ecef_ || columns_[Longitude].has_value(), "longitude");
    require(ecef_ || columns_[Height] || columns_[HeightMsl] || !heights_.needed, "height");
  }

  /// trajectory.columns for this file, from column names of other programs.
  [[nodiscard]] std::string hint_for(const Fields& header) {
    constexpr std::pair<Quantity, std::string_view> kOthers[] = {
        {Time, kTimeNames},
        {Latitude, "latitude lat phi"},
        {Longitude, "longitude lon long lng lambda"},
        {Height, "height altitude alt hgt ele elevation ellipsoidalheight heightellipsoid h"}};
    const auto record = file_.peek_line();
    const Fields values = record ? csv_fields(*record, separator_of(*record)) : Fields();
    const auto number = [&](std::size_t i) {
      return i < values.size() ? number_of(values[i]) : std::nullopt;
    };
    std::vector<std::string> parts;
    for (const auto& [q, names] : kOthers) {
      for (std::size_t i = 0; i < header.size(); ++i) {
        const auto [base, unit] = parted(header[i], kRows[q].units);
        if (!has_word(names, plain(base.substr(base.rfind('.') + 1)))) continue;
        const bool bare = unit == nullptr && (q != Time || number(i));
        const double largest = q == Latitude ? geodesy::kPi / 2 : q == Longitude ? geodesy::kPi : 0;
        const Unit& likely = kRows[q].units[std::abs(number(i).value_or(1e9)) <= largest ? 1 : 0];
        parts.push_back(fmt::format("{}: \"{}{}\"", kRows[q].name, header[i],
                                    bare ? fmt::format(" [{}]", likely.name) : ""));
        break;
      }
    }
    if (parts.size() < std::size(kOthers)) return std::string(columns_hint());
    return fmt::format("trajectory.columns: {{{}}}, with their units", fmt::join(parts, ", "));
  }

  /// A line of units below the header must not be skipped as an invalid record.
  void require_numbers(const Fields& fields) const {
    const Column& column = *columns_[ecef_ ? X : Latitude];
    if (column.index >= fields.size() || is_missing(fields[column.index])) return;
    const std::string_view text = fields[column.index];
    if (std::none_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; })) {
      throw file_.error(fmt::format("'{}' below the header is not a number", text),
                        "write units into the header, such as latitude_rad, and numbers below it");
    }
  }

  [[nodiscard]] std::string_view field(const Fields& fields, Quantity q) const {
    return fields[columns_[q]->index];
  }
  [[nodiscard]] double value(const Fields& fields, Quantity q) {
    return to_number(at(), field(fields, q), kRows[q].name) * columns_[q]->scale;
  }
  [[nodiscard]] RecordAt at() { return {path_.report, file_.line()}; }

  void read_record(Fields& fields) {
    if (fields.size() == count_ + 1 && fields.back().empty()) fields.pop_back();
    if (fields.size() != count_)
      throw file_.error(fmt::format("{} columns, but the first line has {}", fields.size(), count_));
    if (doubtful_ && ecef_ && undecided_) {
      const auto metres = [&](Quantity q) {
        return number_of(field(fields, q)).value_or(0) * columns_[q]->scale;
      };
      ecef_ = is_radius(std::hypot(metres(X), metres(Y), metres(Z)));
    }
    const Quantity height = columns_[Height] ? Height : HeightMsl;
    const auto missing = [&](Quantity q) { return columns_[q] && is_missing(field(fields, q)); };
    const bool flat = !ecef_ && (!columns_[height] || missing(height));
    if (missing(weeks_               ? Tow
                : columns_[UnixTime] ? UnixTime
                                     : Time) ||
        (ecef_ ? missing(X) || missing(Y) || missing(Z) : missing(Latitude) || missing(Longitude)) ||
        (flat && heights_.needed))
      throw NoValue(file_.path(), file_.line(), "line without a time or a position");
    const GpsTime time = path_.timed ? time_of(fields) : GpsTime();
    Geodetic position;
    if (ecef_) {
      position = position_of(at(), Eigen::Vector3d(value(fields, X), value(fields, Y), value(fields, Z)));
    } else {
      position = position_of(at(), value(fields, Latitude), value(fields, Longitude));
      doubtful_ = doubtful_ && std::abs(value(fields, Latitude)) <= geodesy::kPi / 2 &&
                  std::abs(value(fields, Longitude)) <= geodesy::kPi;
      if (!flat) height_m_ = value(fields, height);
      if (!flat && height == HeightMsl)
        height_m_ = from_sea_level(at(), height_m_, "height above sea level by its column", heights_);
      position.height_m = height_m_;
    }
    geodesy::check_geodetic(position, "position");
    path_.points.push_back({time, position, file_.line()});
    undecided_ = false;
  }

  /// Notes assumptions about the file.
  void note_doubts() {
    if (doubtful_ && !ecef_ && !path_.points.empty()) {
      path_.report.guess(path_.points.front().line, "latitude and longitude without a unit may be radians",
                         "taken as degrees; name the columns with their unit, latitude_rad or latitude_deg");
    }
  }

  [[nodiscard]] GpsTime time_of(const Fields& fields) {
    if (weeks_) {
      constexpr double kCycle = 1024;
      double week = value(fields, Week);
      if (columns_[Cycle]) {
        week = std::fmod(week, kCycle) + kCycle * value(fields, Cycle);
      } else if (week > 0 && week < kCycle) {
        throw file_.error(fmt::format("the GPS week {} is not counted from 1980", week),
                          "write full weeks, or name the column of their cycles of 1,024: gps_cycle");
      }
      return time_of_week(at(), week, value(fields, Tow));
    }
    if (columns_[UnixTime]) {
      constexpr double kLatest_s = 4.1e9;  // the year 2099
      const double seconds = value(fields, UnixTime);
      if (!(seconds >= 0 && seconds < kLatest_s)) {
        throw file_.error(fmt::format("'{}' is not a Unix time of 1970 to 2099", field(fields, UnixTime)),
                          "its unit is part of its name: unix_time_s, unix_time_ms, _us, _ns");
      }
      return set_time(at(), geodesy::gps_from_unix(std::llround(seconds * 1e9)));
    }
    const std::string_view text = field(fields, Time);
    const bool date = !columns_[Time]->unit && !number_of(text);
    if (relative_ && *relative_ == date)
      throw file_.error(fmt::format("the time '{}' has another format than the times above", text));
    relative_ = !date;
    if (date) return time_of_text(at(), text);
    if (dates_) {
      throw file_.error(fmt::format("the unit of the time '{}' is missing", text),
                        "write it as in trajectory.columns: {time: \"stamp [ms]\"}: counted from start");
    }
    path_.is_dated = false;
    return from_start(value(fields, Time), text);
  }

  [[nodiscard]] GpsTime from_start(double seconds, std::string_view text) const {
    if (start_ == GpsTime{}) {
      throw file_.error("times are seconds from the start, and the scenario has no start",
                        "add 'start: 2026-01-01T12:00:00Z' to the scenario, or write ISO 8601 times");
    }
    if (std::abs(seconds) > 1e7) {
      throw file_.error(
          fmt::format("the time {} is more than 1e7 s from the scenario's start", text),
          "name the column by its content: time_ms, unix_time_s, unix_time_ms, gps_week and gps_tow");
    }
    return start_ + seconds;
  }

  TextFile& file_;
  GpsTime start_;
  HeightReading heights_;
  RecordedPath path_;
  const TrajectoryColumns* given_ = nullptr;
  bool numbers_ = false;  ///< columns are given by their numbers
  std::optional<std::string_view> header_;
  Columns columns_;
  char separator_ = ',';
  std::size_t count_ = 0;
  bool weeks_ = false, ecef_ = false;
  bool undecided_ = true;  ///< no record has yet decided ecef_
  bool doubtful_ = false;  ///< angles have no unit, and all were in the range of radians
  bool dates_ = false;     ///< trajectory.columns: times are dates
  std::optional<bool> relative_;
  double height_m_ = 0;
};

/// "22 18 04.31949" in degrees; the sign of the degrees is that of all three.
double degrees_of(const RecordAt& at, std::span<const std::string_view> parts) {
  const double d = to_number(at, parts[0], "degrees");
  const double m = to_number(at, parts[1], "minutes"), s = to_number(at, parts[2], "seconds");
  if (!(m >= 0 && m < 60 && s >= 0 && s < 60)) {
    throw at.error(
        fmt::format("'{} {} {}' are not degrees, minutes and seconds", parts[0], parts[1], parts[2]),
        "minutes and seconds are from 0 to 60");
  }
  return std::copysign(std::abs(d) + m / 60 + s / 3600, parts[0][0] == '-' ? -1 : 1);
}

/// Calls `read` for the lines that are not comments by these marks, and checks the result.
template <typename Read>
RecordedPath read_lines(TextFile& file, std::string_view marks, const Read& read) {
  RecordedPath path;
  path.report = ReadReport(file.path());
  while (const auto line = file.next_line()) {
    if (is_skipped(*line, marks)) continue;
    guard_record(path.report, [&] { read(*line, RecordAt{path.report, file.line()}, path.points); });
  }
  path.report.require_majority(path.points.size());
  if (path.points.empty()) throw InputError(file.path(), 0, "no position in it");
  return path;
}

bool is_blank_separated(std::string_view line) {
  return line.find(',') == std::string_view::npos && split_blanks(line).size() >= 10;
}

/// The time system in a comment that names the columns of RTKLIB's solutions; empty for other comments.
std::string_view names_rtklib(std::string_view comment) {
  std::string text(without_mark(comment));
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == ',' || c == ';'; }, ' ');
  const Fields words = split_blanks(text);
  if (words.size() < 2) return {};
  for (const std::string_view zone : {"GPST", "UTC", "JST"}) {
    if (words[0] != zone) continue;
    for (const std::string_view position : {"latitude(", "x-ecef(m)", "e-baseline(m)"})
      if (words[1].starts_with(position)) return zone;
  }
  return {};
}

/// Reads the lines of one solution of RTKLIB.
class RtklibReader {
 public:
  explicit RtklibReader(const HeightReading& heights) : heights_(heights) {}

  void read(std::string_view line, const RecordAt& at, RecordedPoints& points) {
    if (trim(line).front() == '%') return read_comment(line, at);
    if (zone_.empty()) throw at.error("no column names in a comment above", "keep the header of the file");
    std::string text(line);
    std::replace(text.begin(), text.end(), ',', ' ');
    const Fields words = split_blanks(text);
    if (words.size() < 2 + (parted_ ? 7 : 3)) throw at.error("is cut short");
    GpsTime time;
    if (words[0].find('/') != std::string_view::npos) {
      std::string date = fmt::format("{}T{}{}", words[0], words[1], zone_);
      std::replace(date.begin(), date.end(), '/', '-');
      time = time_of_text(at, date);
    } else {
      time = time_of_week(at, to_number(at, words[0], "GPS week"), to_number(at, words[1], "time of week"));
    }
    const std::span<const std::string_view> position = std::span(words).subspan(2);
    points.push_back({time, position_at(at, position), at.line});
  }

 private:
  void read_comment(std::string_view line, const RecordAt& at) {
    // "% (lat/lon/height=WGS84/geodetic,Q=1:fix,...)": heights above the geoid.
    if (line.find("/geodetic") != std::string_view::npos) sea_level_ = true;
    const std::string_view zone = names_rtklib(line);
    if (zone.empty()) return;
    const auto has = [line](std::string_view word) { return line.find(word) != std::string_view::npos; };
    if (has("e-baseline(m)"))
      throw at.error("is a baseline, without a position on Earth", "write latitude, longitude, height");
    parted_ = has("latitude(d'\")");
    ecef_ = has("x-ecef(m)");
    zone_ = zone == "GPST" ? " GPST" : zone == "JST" ? "+09:00" : "Z";
  }
  [[nodiscard]] Geodetic position_at(const RecordAt& at, std::span<const std::string_view> words) const {
    if (ecef_) {
      return position_of(at, Eigen::Vector3d(to_number(at, words[0], "x"), to_number(at, words[1], "y"),
                                             to_number(at, words[2], "z")));
    }
    Geodetic position =
        parted_ ? position_of(at, degrees_of(at, words.first(3)), degrees_of(at, words.subspan(3, 3)))
                : position_of(at, to_number(at, words[0], "latitude"), to_number(at, words[1], "longitude"));
    position.height_m = to_number(at, words[parted_ ? 6 : 2], "height");
    if (sea_level_)
      position.height_m =
          from_sea_level(at, position.height_m, "height above sea level by the header", heights_);
    return position;
  }

  HeightReading heights_;
  std::string_view zone_;  ///< of dates; empty: no header yet
  bool sea_level_ = false, parted_ = false, ecef_ = false;
};

}  // namespace

RecordedPath read_csv(TextFile& file, GpsTime start, const HeightReading& heights,
                      const TrajectoryColumns& columns) {
  return CsvReader(file, start, heights).read(columns);
}

RecordedPath read_rtklib(TextFile& file, const HeightReading& heights) {
  RtklibReader reader(heights);
  return read_lines(file, "#", [&](std::string_view line, const RecordAt& at, RecordedPoints& points) {
    reader.read(line, at, points);
  });
}

bool is_rtklib(const std::filesystem::path& path) {
  TextFile file = TextFile::streamed(path);
  auto line = file.next_line();
  while (line && is_skipped(*line)) {
    if (line->starts_with("% program ") || !names_rtklib(*line).empty()) return true;
    line = file.next_line();
  }
  return false;
}

RecordedPath read_urbannav(TextFile& file) {
  std::size_t columns = 0;
  return read_lines(
      file, kCommentMarks, [&](std::string_view line, const RecordAt& at, RecordedPoints& points) {
        if (is_blank_separated(line)) {
          const Fields words = split_blanks(line);
          const auto part = [&](std::size_t i) { return std::span(words).subspan(i, 3); };
          Geodetic position = position_of(at, degrees_of(at, part(3)), degrees_of(at, part(6)));
          position.height_m = to_number(at, words[9], "height");
          points.push_back(
              {time_of_week(at, to_number(at, words[1], "GPS week"), to_number(at, words[2], "time of week")),
               position, at.line});
          return;
        }
        const Fields fields = split(line, ',');
        if (columns == 0) columns = fields.size();
        if (fields.size() < 5 || fields.size() != columns)
          throw at.error(
              fmt::format("{} columns, but {} are needed", fields.size(), std::max<std::size_t>(columns, 5)),
              "columns are GPS week, time of week, latitude, longitude, height");
        const GpsTime time =
            time_of_week(at, to_number(at, fields[0], "GPS week"), to_number(at, fields[1], "time of week"));
        Geodetic position =
            position_of(at, to_number(at, fields[2], "latitude"), to_number(at, fields[3], "longitude"));
        position.height_m = to_number(at, fields[4], "height");
        points.push_back({time, position, at.line});
      });
}

bool is_urbannav(const std::filesystem::path& path) {
  TextFile file = TextFile::streamed(path);
  auto first = file.next_line();
  while (first && is_skipped(*first)) first = file.next_line();
  const std::string_view line = first.value_or(std::string_view());
  const bool blanks = is_blank_separated(line);
  const Fields fields = blanks ? split_blanks(line) : split(line, ',');
  if (!blanks && fields.size() != 5) return false;
  const auto week = parse_double(fields[blanks ? 1 : 0]), tow_s = parse_double(fields[blanks ? 2 : 1]);
  return week && tow_s && *week == std::floor(*week) && *week > 1000 && *week < 10'000 && *tow_s >= 0 &&
         *tow_s < static_cast<double>(GpsTime::kSecondsPerWeek);
}

std::vector<CsvQuantity> csv_quantities() {
  std::vector<CsvQuantity> quantities;
  quantities.reserve(std::size(kRows));
  for (const Row& row : kRows) quantities.push_back({row.name, row.help});
  return quantities;
}

}  // namespace canyon::simulation
