#include "canyon/simulation/motion/csv_columns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>

#include "canyon/base/text.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/simulation/motion/column_points.hpp"
#include "canyon/simulation/motion/csv_times.hpp"

namespace canyon::simulation {
namespace {

using Words = std::vector<std::string>;

bool is_one_of(std::string_view word, std::initializer_list<std::string_view> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

/// The words of a column's name in lower case: "AltitudeMeters", "alt [m]" and "alt_m" have two.
Words words_of(std::string_view name) {
  Words words(1);
  const auto type = [&](std::size_t i) { return i < name.size() ? static_cast<unsigned char>(name[i]) : 0; };
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (name.compare(i, 2, "\xC2\xB0") == 0) {  // the degree sign
      if (words.back().empty()) words.pop_back();
      words.emplace_back("deg");
      words.emplace_back();
      ++i;
      continue;
    }
    const bool begins = std::isupper(type(i)) != 0 && i > 0 && std::islower(type(i - 1)) != 0;
    if ((begins || std::isalnum(type(i)) == 0) && !words.back().empty()) words.emplace_back();
    if (std::isalnum(type(i)) != 0) words.back() += static_cast<char>(std::tolower(type(i)));
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

enum class Kind : std::uint8_t { Other, Time, Latitude, Longitude, Height, X, Y, Z };

Kind kind_of(std::string_view word, bool first) {
  if (is_one_of(word, {"time", "timestamp", "datetime", "gpstime", "utctime"}) || (first && word == "t"))
    return Kind::Time;
  if (first && word == "hae") return Kind::Height;
  if (is_one_of(word, {"lat", "latitude"})) return Kind::Latitude;
  if (is_one_of(word, {"lon", "lng", "long", "longitude"})) return Kind::Longitude;
  if (is_one_of(word, {"height", "alt", "altitude", "elevation", "ele"}) || (first && word == "h"))
    return Kind::Height;
  if (word == "x") return Kind::X;
  if (word == "y") return Kind::Y;
  return word == "z" ? Kind::Z : Kind::Other;
}

/// The unit of Garmin's FIT.
constexpr double kSemicircle_deg = 180.0 / 2147483648.0;

std::optional<double> unit_of(std::string_view word, Kind kind) {
  static const std::map<std::string_view, double> kAngles{{"deg", 1},
                                                          {"degree", 1},
                                                          {"degrees", 1},
                                                          {"rad", geodesy::degrees(1.0)},
                                                          {"radian", geodesy::degrees(1.0)},
                                                          {"radians", geodesy::degrees(1.0)},
                                                          {"e7", 1e-7},
                                                          {"1e7", 1e-7},
                                                          {"dege7", 1e-7},
                                                          {"semicircle", kSemicircle_deg},
                                                          {"semicircles", kSemicircle_deg},
                                                          {"ddmm", 1},
                                                          {"nmea", 1},
                                                          {"dms", 1}};
  static const std::map<std::string_view, double> kLengths{
      {"m", 1},     {"meter", 1},  {"meters", 1},  {"metre", 1},     {"metres", 1},   {"km", 1000},
      {"cm", 0.01}, {"mm", 0.001}, {"ft", 0.3048}, {"foot", 0.3048}, {"feet", 0.3048}};
  static const std::map<std::string_view, double> kTimes{{"s", 1},
                                                         {"sec", 1},
                                                         {"secs", 1},
                                                         {"second", 1},
                                                         {"seconds", 1},
                                                         {"ms", 1e-3},
                                                         {"msec", 1e-3},
                                                         {"millis", 1e-3},
                                                         {"milliseconds", 1e-3},
                                                         {"us", 1e-6},
                                                         {"usec", 1e-6},
                                                         {"micros", 1e-6},
                                                         {"microseconds", 1e-6},
                                                         {"ns", 1e-9},
                                                         {"nanos", 1e-9},
                                                         {"nanoseconds", 1e-9}};
  const auto& units = kind == Kind::Time                                  ? kTimes
                      : kind == Kind::Latitude || kind == Kind::Longitude ? kAngles
                                                                          : kLengths;
  const auto found = units.find(word);
  return found == units.end() ? std::nullopt : std::optional<double>(found->second);
}

struct Named {
  Kind kind = Kind::Other;
  CsvColumn column;
  CsvClock clock = CsvClock::Unsaid;
};

/// The name without that of the MAVLink message whose field it is, as mavlogdump.py writes it.
std::string_view without_message(std::string_view name) {
  name = trim(name);
  for (const std::string_view message : {"GPS_RAW_INT.", "GLOBAL_POSITION_INT."})
    if (name.starts_with(message)) return name.substr(message.size());
  return name;
}

/// MAVLink's units of fields that a name gives no unit: degrees times 1e7, millimetres above sea level.
void set_mavlink_units(Named& named) {
  if (named.kind == Kind::Latitude || named.kind == Kind::Longitude) named.column.scale = 1e-7;
  if (named.kind == Kind::Height) {
    named.column.scale = 1e-3;
    named.column.sea_level = true;
  }
  named.column.unit = named.kind != Kind::Time;
}

/// The meaning of a name; of the kind Other where it says anything that is not known ("speed", "relative").
Named read_name(std::size_t index, std::string_view name) {
  if (const std::string_view field = without_message(name); field != trim(name)) {
    Named named = read_name(index, field);
    set_mavlink_units(named);
    return named;
  }
  Named named;
  named.column.index = index;
  named.column.name = std::string(trim(name));
  const Words words = words_of(name);
  for (std::size_t i = 0; i < words.size() && named.kind == Kind::Other; ++i)
    named.kind = kind_of(words[i], i == 0);
  const bool clock_alone = words.size() == 1 && is_one_of(words[0], {"utc", "gpst", "jst"});
  if (clock_alone) named.kind = Kind::Time;
  if (named.kind == Kind::Other) return named;
  const bool angle = named.kind == Kind::Latitude || named.kind == Kind::Longitude;
  const auto names = [&words](std::string_view word) {
    return std::find(words.begin(), words.end(), word) != words.end();
  };
  if (named.kind == Kind::Latitude && names("s") && !names("n")) named.column.side = "S";
  if (named.kind == Kind::Longitude && names("w") && !names("e")) named.column.side = "W";
  std::size_t kinds = 0;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word == "gpstime") named.clock = CsvClock::Gps;
    if (word == "utctime") named.clock = CsvClock::Utc;
    if (named.kind == Kind::Height &&
        is_one_of(word, {"hae", "ell", "ellipsoid", "ellipsoidal", "wgs84", "wgs84ellipsoid"})) {
      named.column.ellipsoid = true;
    } else if (kind_of(word, i == 0) != Kind::Other) {
      if (++kinds > 1) return {};
    } else if (const auto unit = unit_of(word, named.kind)) {
      named.column.scale = *unit;
      named.column.unit = true;
      named.column.minutes = named.column.minutes || is_one_of(word, {"ddmm", "nmea"});
    } else if (named.kind == Kind::Time && is_one_of(word, {"utc", "gpst", "gps", "jst"})) {
      named.clock = word == "utc" ? CsvClock::Utc : word == "jst" ? CsvClock::Jst : CsvClock::Gps;
    } else if (named.kind == Kind::Time && is_one_of(word, {"unix", "posix", "epoch"})) {
      named.clock = CsvClock::Unix;
    } else if (named.kind == Kind::Time && word == "date") {
      continue;
    } else if (angle && word == "d" && name.find("d'\"") != std::string_view::npos) {  // RTKLIB
      named.column.parted = true;
    } else if (named.kind == Kind::Height &&
               is_one_of(word, {"msl", "amsl", "orthometric", "sea", "level"})) {
      named.column.sea_level = true;
    } else if (named.kind != Kind::Time && is_one_of(word, {"true", "truth", "groundtruth", "gt"})) {
      named.column.truth = true;
    } else if (!is_one_of(word, {"gps", "gnss", "ecef", "wgs84", "position", "pos", "decimal", "above",
                                 "mean", "field", "data", "fix", "navsatfix"}) &&
               !(angle && is_one_of(word, {"n", "s", "e", "w"}))) {
      return {};
    }
  }
  return named;
}

/// Whether a name is that of the minutes or seconds of an angle: "lat_min", "longitude_seconds".
bool names_part_of_angle(const Words& words) {
  const auto names = [&words](const auto& is) { return std::any_of(words.begin(), words.end(), is); };
  return names([](const std::string& word) {
           return kind_of(word, false) == Kind::Latitude || kind_of(word, false) == Kind::Longitude;
         }) &&
         names([](const std::string& word) {
           return is_one_of(word, {"min", "mins", "minute", "minutes", "arcmin", "sec", "secs", "second",
                                   "seconds", "arcsec"});
         });
}

/// Whether a name is that of a column that says if there is a fix, and the least number that says so.
std::optional<double> least_number(const Words& words) {
  const std::string name = fmt::format("{}", fmt::join(words, ""));
  if (is_one_of(name, {"fixtype", "gpsfixtype", "fixmode", "gpsmode", "gnssmode"})) return 2;
  // ROS: -1 is no fix.
  if (is_one_of(name, {"status", "gpsstatus", "fixstatus", "navstatus", "statusstatus", "fieldstatusstatus"}))
    return 0;
  if (is_one_of(name,
                {"fix", "gpsfix", "fixquality", "quality", "gpsquality", "qual", "q", "valid", "isvalid",
                 "fixvalid", "gpsvalid", "latlonvalid", "gnssfixok", "fixok", "hasfix", "provider"}))
    return 1;
  return std::nullopt;
}

/// Columns of the GPS week and of the time in it: what the name says of units; ms of ArduPilot and of UBX.
bool names_week(std::string_view joined) {
  return is_one_of(joined, {"week", "gpsweek", "wn", "wnc", "gwk", "gpswn", "weekno", "gpsweekno",
                            "weeknumber", "gpsweeknumber"});
}
std::optional<double> time_of_week_unit_s(std::string_view joined) {
  if (is_one_of(joined, {"gms", "itow", "itowms", "towms", "gpstowms", "gpsms", "weekms"})) return 1e-3;
  if (is_one_of(joined, {"tow", "tows", "towsec", "gpstow", "gpstows", "sow", "gpssow", "gpsseconds",
                         "gpssec", "gpss", "secondsofweek", "secondofweek", "secofweek", "timeofweek",
                         "timeofweeks", "gpstimeofweek", "weekseconds"}))
    return 1;
  return std::nullopt;
}

/// Which of several columns of a kind is the path's: a true place beats a fix, a height above the ellipsoid
/// another, and a clock's time in a unit seconds since anything.
int rank(const Named& named) {
  if (named.kind != Kind::Time) return (named.column.truth ? 2 : 0) + (named.column.ellipsoid ? 1 : 0);
  return named.clock == CsvClock::Unix || (named.clock == CsvClock::Utc && named.column.unit) ? 1 : 0;
}

/// Takes the sign of N, S, E, W (or a word that begins so); 0 for anything else.
int side_sign(std::string_view side, bool latitude) {
  if (side.empty()) return 0;
  const char c = static_cast<char>(std::toupper(static_cast<unsigned char>(side.front())));
  if (c == (latitude ? 'N' : 'E')) return 1;
  return c == (latitude ? 'S' : 'W') ? -1 : 0;
}

}  // namespace

CsvColumns::CsvColumns() {
  for (std::size_t k = 0; k < 3; ++k) place[k].index = k + 1;
}

CsvColumns::CsvColumns(const TextFile& file, const std::vector<std::string_view>& header, char between)
    : separator(between), count(header.size()) {
  std::map<Kind, Named> found;
  std::optional<CsvColumn> tow;
  std::optional<std::size_t> mode, part_of_angle;
  bool ardupilot = false, limits = false;
  for (std::size_t i = 0; i < header.size(); ++i) {
    const Words words = words_of(without_message(header[i]));
    const std::string joined = fmt::format("{}", fmt::join(words, ""));
    const Named named = read_name(i, header[i]);
    if (names_part_of_angle(words)) part_of_angle = i;
    limits = limits || std::find(words.begin(), words.end(), "max") != words.end();
    if (named.kind != Kind::Other) {
      const auto at = found.find(named.kind);
      if (at != found.end() && named.kind != Kind::Time && trim(header[i]) == at->second.column.name) {
        throw file.error(fmt::format("the header names two columns '{}'", trim(header[i])),
                         "rename the one that is not the path");
      }
      if (at == found.end() || rank(named) > rank(at->second)) found[named.kind] = named;
    } else if (const auto least = least_number(words); least && !fix) {
      fix = i;
      least_fix = *least;
    } else if (joined == "mode") {
      mode = i;
    } else if (is_one_of(joined, {"hacc", "accuracy", "accuracym", "acc", "horizontalaccuracy",
                                  "horizontalaccuracym", "haccm", "haccmm", "eph", "epx"})) {
      accuracy = i;
    } else if (names_week(joined)) {
      ardupilot = ardupilot || joined == "gwk";
      week = i;
    } else if (const auto unit_s = time_of_week_unit_s(joined)) {
      tow = CsvColumn{i, std::string(trim(header[i])), *unit_s, true};
    } else if (is_one_of(joined, {"numsats", "nsats", "nsat", "numsv", "sats", "satellites", "satellitesused",
                                  "numsatellites", "numberofsatellites", "satsused", "ns"})) {
      satellites = i;
      if (joined == "ns") latitude_side = i;       // or north, south
    } else if (joined == "millissincegpsepoch") {  // Google's decimetre challenge
      found[Kind::Time] = {Kind::Time, CsvColumn{i, std::string(trim(header[i])), 1e-3, true},
                           CsvClock::GpsEpoch};
    } else if (is_one_of(joined, {"date", "utcdate", "dateutc", "dategps", "gpsdate", "dategpst"})) {
      date = i;
    } else if (is_one_of(joined,
                         {"geoid", "undulation", "geoidheight", "geoidundulation", "geoidseparation"})) {
      geoid = i;
    } else if (is_one_of(joined, {"nors", "latdir", "latref", "lathemisphere", "latituderef", "latitudedir",
                                  "latitudehemisphere", "latns", "latitudens"})) {
      latitude_side = i;
    } else if (is_one_of(joined, {"ew", "eorw", "londir", "lonref", "lonhemisphere", "longituderef",
                                  "longitudedir", "longitudehemisphere", "lonew", "longitudeew"})) {
      longitude_side = i;
    }
  }
  const auto require = [&](Kind kind, std::string_view name) {
    const auto at = found.find(kind);
    if (at != found.end()) return at->second;
    throw file.error(
        fmt::format("the header has no column '{}'", name),
        "name the columns time, latitude, longitude, height, or time, x, y, z (ECEF), with units "
        "such as _deg, _rad, _e7, _m, _ft; commas, semicolons or tabs between");
  };
  // Its numbers may mean anything; "NO FIX" does not.
  if (mode && !fix) {
    fix = mode;
    least_fix = -HUGE_VAL;
  }
  // Its Status 1 is no fix.
  if (ardupilot && fix && least_fix == 0) least_fix = 2;
  time_of_week = week && tow;
  if (time_of_week) found[Kind::Time] = {Kind::Time, *tow};
  const Named named_time = require(Kind::Time, "time");
  time = named_time.column;
  clock = named_time.clock;
  // A date beside seconds from the start is another column.
  if (time.unit || lower_case(time.name) == "t") date.reset();
  ecef = found.count(Kind::Latitude) == 0 && found.count(Kind::X) > 0 && found.count(Kind::Y) > 0 &&
         found.count(Kind::Z) > 0;
  place[0] = require(ecef ? Kind::X : Kind::Latitude, "latitude").column;
  if (part_of_angle && !limits && !ecef) {
    throw file.error(
        fmt::format("the header has minutes or seconds of an angle in a column of their own, '{}'",
                    trim(header[*part_of_angle])),
        "write latitude and longitude as degrees with decimals, in one column each");
  }
  place[1] = require(ecef ? Kind::Y : Kind::Longitude, "longitude").column;
  place[2] = require(ecef ? Kind::Z : Kind::Height, "height").column;
  // A true place is known without a fix.
  if (place[0].truth && place[1].truth) {
    fix.reset();
    accuracy.reset();
    satellites.reset();
  }
  // Its Alt is above sea level.
  place[2].sea_level = place[2].sea_level || (ardupilot && !ecef && !place[2].ellipsoid);
  fit = !ecef && place[0].scale == kSemicircle_deg;
}

char separator_of(std::string_view line) {
  for (const char separator : {';', '\t'})
    if (std::count(line.begin(), line.end(), separator) >= 3) return separator;
  const std::vector<std::string_view> words = split_blanks(line);
  if (line.find(',') != std::string_view::npos || words.size() < 4) return ',';
  // Numbers alone may be anything, such as bytes in hexadecimal.
  return names_positions(words) || !iso_date(words[0]).empty() ? ' ' : ',';
}

namespace {

/// One field of `count` that stand one behind the other.
void join(std::vector<std::string_view>& fields, std::size_t first, std::size_t count) {
  const char* const begin = fields[first].data();
  const std::string_view last = fields[first + count - 1];
  fields[first] = {begin, static_cast<std::size_t>(last.data() + last.size() - begin)};
  const auto at = fields.begin() + static_cast<std::ptrdiff_t>(first);
  fields.erase(at + 1, at + static_cast<std::ptrdiff_t>(count));
}

/// Degrees, minutes and seconds of a line of data, of which a date and a time are still two fields.
void join_angles(std::vector<std::string_view>& fields, const CsvColumns& columns) {
  if (!columns.place[0].parted || !columns.place[1].parted || fields.size() < columns.count + 4) return;
  const std::size_t date = fields.size() - columns.count - 4;
  std::array<std::size_t, 2> at{columns.place[0].index, columns.place[1].index};
  std::sort(at.begin(), at.end());
  for (const std::size_t index : at)
    if (index + date + 3 <= fields.size()) join(fields, index + date, 3);
}

}  // namespace

std::vector<std::string_view> fields_of(std::string_view line, const CsvColumns& columns) {
  if (columns.separator != ' ') return csv_fields(line, columns.separator);
  std::vector<std::string_view> fields = split_blanks(line);
  join_angles(fields, columns);
  if (fields.size() < 2 || columns.date || columns.week) return fields;
  const bool date = !iso_date(fields[0]).empty() && fields[1].find(':') != std::string_view::npos;
  const bool one_more = columns.count > 0 && fields.size() == columns.count + 1;
  if (date || (one_more && columns.time.index == 0 && parse_integer(fields[0]))) {
    join(fields, 0, 2);
  }
  return fields;
}

bool names_positions(const std::vector<std::string_view>& fields) {
  std::size_t places = 0;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const Kind kind = read_name(i, fields[i]).kind;
    if (kind != Kind::Other && kind != Kind::Time) ++places;
  }
  return places >= 3;
}

bool names_others(const std::vector<std::string_view>& fields, std::size_t data) {
  if (fields.size() < 4 || fields.size() > data || fields.size() + 1 < data) return false;
  bool any = false;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (parse_double(fields[i])) return false;
    any = any || read_name(i, fields[i]).kind != Kind::Other;
  }
  return any && !names_positions(fields);
}

std::vector<std::string> with_units(const std::vector<std::string_view>& header,
                                    const std::vector<std::string_view>& below) {
  if (below.size() != header.size()) return {};
  std::vector<std::string> names;
  std::size_t units = 0;
  for (std::size_t i = 0; i < header.size(); ++i) {
    std::string_view field = trim(below[i]);
    const bool brackets = field.size() > 1 && (field.front() == '[' || field.front() == '(');
    if (brackets) field = trim(field.substr(1, field.size() - 2));
    if (parse_double(field)) return {};
    const Words words = words_of(field);
    const Kind kind = read_name(i, header[i]).kind;
    const bool unit = words.size() == 1 && unit_of(words[0], kind).has_value();
    // A position in a unit that is not known must not pass for one in degrees or metres.
    const bool place = kind != Kind::Other && kind != Kind::Time;
    if (place && !field.empty() && !unit && !brackets) return {};
    if (kind != Kind::Other && unit) ++units;
    names.emplace_back(header[i]);
    if (unit || (place && !field.empty())) names.back().append(" ").append(field);
  }
  return units >= 2 ? names : std::vector<std::string>();
}

std::optional<double> angle_deg(std::string_view text, std::string_view side, bool latitude, bool minutes) {
  std::string rest(trim(text));
  int sign = 0;
  if (!side.empty()) {
    sign = side_sign(trim(side), latitude);
    if (sign == 0) return std::nullopt;
  }
  for (const std::size_t at : {std::size_t{0}, rest.size() - 1}) {
    if (rest.empty() || std::isalpha(static_cast<unsigned char>(rest[at])) == 0) continue;
    const int own = side_sign(std::string_view(rest).substr(at, 1), latitude);
    if (own == 0 || (sign != 0 && own != sign)) return std::nullopt;
    sign = own;
    rest.erase(at, 1);
    break;
  }
  if (const auto plain = field_number(rest); plain && !minutes) {
    if (sign > 0 && *plain < 0) return std::nullopt;
    return sign < 0 ? -std::abs(*plain) : *plain;
  }
  for (const std::string_view mark : {"\xC2\xB0", "\xE2\x80\xB2", "\xE2\x80\xB3", "'", "\"", ":"}) {
    for (std::size_t at = rest.find(mark); at != std::string::npos; at = rest.find(mark, at))
      rest.replace(at, mark.size(), " ");
  }
  const std::vector<std::string_view> parts = split_blanks(rest);
  if (parts.empty() || parts.size() > 3) return std::nullopt;
  double angle = 0, unit = 1;
  for (std::size_t k = 0; k < parts.size(); ++k, unit /= 60) {
    const auto value = field_number(parts[k]);
    if (!value || (k > 0 && !(*value >= 0 && *value < 60))) return std::nullopt;
    angle += std::abs(*value) * unit;
  }
  if (minutes && parts.size() == 1) {
    const double degrees = std::trunc(angle / 100), over = angle - 100 * degrees;
    if (over >= 60) return std::nullopt;
    angle = degrees + over / 60;
  }
  const bool negative = parts.front().front() == '-';
  if (sign > 0 && negative) return std::nullopt;
  return sign < 0 || negative ? -angle : angle;
}

}  // namespace canyon::simulation
