#include "canyon/sky/rinex/observation_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/text.hpp"

namespace canyon::rinex {
namespace {

/// Positions of the parts of an epoch line.
struct EpochColumns {
  TimeColumns time;
  std::size_t flag;
  FieldColumns clock;
};

std::optional<EpochLine> epoch_fields(std::string_view line, const EpochColumns& at,
                                      std::string_view time_system) {
  EpochLine result;
  const std::string_view flag = column(line, at.flag, 1);
  const auto count = parse_integer(column(line, at.flag + 1, 3));
  if (flag.empty() || flag[0] < '0' || flag[0] > '6' || !count || *count < 0) return std::nullopt;
  result.flag = flag[0] - '0';
  result.count = static_cast<std::size_t>(*count);
  const bool event = result.flag >= 2 && result.flag <= 5;
  const std::size_t date = at.time.front().begin;
  if (is_blank(column(line, date, at.flag - date))) return event ? std::optional(result) : std::nullopt;
  result.time = time_in(line, at.time, time_system);
  if (!result.time) return std::nullopt;
  double offset = 0;
  if (!event && parse_field(column(line, at.clock.begin, at.clock.width), offset) == ObservationField::Number)
    result.clock_offset_s = offset;
  return result;
}

constexpr std::size_t kLabel = 60;

std::optional<Eigen::Vector3d> three_numbers(std::string_view line) {
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) {
    const auto value = parse_double(column(line, static_cast<std::size_t>(14 * i), 14));
    if (!value) return std::nullopt;
    v[i] = *value;
  }
  return v;
}

HeaderRecords::Result damaged(std::string_view reason) {
  return {HeaderRecords::Outcome::Damaged, std::string(reason)};
}
HeaderRecords::Result fatal(std::string_view reason) {
  return {HeaderRecords::Outcome::Fatal, std::string(reason)};
}

using gnss::System;

/// Version 2 does not give the tracked component: X, but I for BeiDou, whose pilots were added later. 2.12 (A
/// for C/A, B for L1C, C for L2C, D for GLONASS's C/A of L2) no longer uses 2 for L2C.
constexpr double k212 = 2.115, k3 = 3;
constexpr Version2Types kVersion2[] = {
    {"GRJS", "1C", "CA", 'A', k212, k3}, {"GRJES", "1C", "C1", '1', 0, k3}, {"GRJ", "1P", "P1", '1', 0, k3},
    {"GJ", "1X", "CB", 'B', k212, k3},   {"GJ", "2X", "CC", 'C', k212, k3}, {"GJ", "2X", "C2", '2', 0, k212},
    {"R", "2C", "CD", 'D', k212, k3},    {"R", "2C", "C2", '2', 0, k3},     {"R", "2P", "P2", '2', 0, k3},
    {"G", "2W", "P2", '2', 0, k3},       {"GJES", "5X", "C5", '5', 0, k3},  {"E", "7X", "C7", '7', 0, k3},
    {"C", "2I", "C2", '2', k212, k3},    {"C", "2I", "C1", '1', 0, k212},   {"C", "7I", "C7", '7', 0, k3},
    {"C", "6I", "C6", '6', 0, k3},       {"EJ", "6X", "C6", '6', 0, k3},    {"E", "8X", "C8", '8', 0, k3},
};

std::vector<std::string> listed(const gnss::Signal& signal, double version) {
  // Only 3.02 calls the band of B1I 1, which is B1C's in all other versions.
  const bool b1i_band1 = signal.system == System::BeiDou && version > 3.015 && version < 3.025;
  if (b1i_band1 && signal.code.front() == '1') return {};
  std::vector<std::string> codes{std::string(signal.code)};
  for (const std::string_view code : split_blanks(signal.also_read)) codes.emplace_back(code);
  if (b1i_band1 && signal.code.front() == '2') codes.insert(codes.end(), {"1X", "1Q"});
  return codes;
}

}  // namespace

bool is_blank(std::string_view text) {
  return text.find_first_not_of(' ') == std::string_view::npos;
}

ObservationField parse_field(std::string_view text, double& value) {
  static constexpr double kPowers[] = {1,   1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                       1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  std::size_t i = 0;
  while (i < text.size() && text[i] == ' ') ++i;
  if (i == text.size()) return ObservationField::Blank;
  const std::size_t begin = i;
  const bool negative = text[i] == '-';
  if (negative) ++i;
  std::int64_t mantissa = 0;
  int digits = 0, decimals = -1;
  for (; i < text.size() && digits <= 15; ++i) {
    if (is_digit(text[i])) {
      mantissa = 10 * mantissa + (text[i] - '0');
      ++digits;
      if (decimals >= 0) ++decimals;
    } else if (text[i] == '.' && decimals < 0) {
      decimals = 0;
    } else {
      break;
    }
  }
  if (digits > 0 && digits <= 15 && is_blank(text.substr(i))) {
    value = static_cast<double>(negative ? -mantissa : mantissa) / kPowers[std::max(decimals, 0)];
    return ObservationField::Number;
  }
  const auto parsed = parse_double(text.substr(begin));
  if (!parsed) return lower_case(trim(text)) == "nan" ? ObservationField::Blank : ObservationField::Bad;
  value = *parsed;
  return ObservationField::Number;
}

// RINEX 2.11, table A2: 1X,I2.2,4(1X,I2),F11.7,2X,I1,I3,12(A1,I2),F12.9
std::optional<EpochLine> epoch_line2(std::string_view line, std::string_view time_system) {
  // Blanks are at positions where a satellite's observations have digits.
  if (line.size() < 29 || line[0] != ' ' || line[3] != ' ' || line[6] != ' ' || line[9] != ' ' ||
      line[12] != ' ' || !is_blank(line.substr(26, 2)))
    return std::nullopt;
  constexpr TimeColumns kTime{{{1, 2}, {3, 3}, {6, 3}, {9, 3}, {12, 3}, {15, 11}}};
  return epoch_fields(line, {kTime, 28, {68, 12}}, time_system);
}

// RINEX 3.05, table A3: '>',1X,I4,4(1X,I2.2),F11.7,2X,I1,I3,6X,F15.12
std::optional<EpochLine> epoch_line3(std::string_view line, std::string_view time_system) {
  if (line.empty() || line[0] != '>') return std::nullopt;
  constexpr TimeColumns kTime{{{2, 4}, {6, 3}, {9, 3}, {12, 3}, {15, 3}, {18, 11}}};
  return epoch_fields(line, {kTime, 31, {41, 15}}, time_system);
}

std::vector<std::string> default_codes(System system, double version) {
  return listed(gnss::signals_of(system).front(), version);
}

std::vector<std::string> signal_codes(const gnss::Signal& signal, double version) {
  std::vector<std::string> codes = listed(signal, version);
  if (gnss::index_of(signal) > 0) return codes;
  for (const gnss::Signal& other : gnss::signals_of(signal.system).subspan(1))
    for (const std::string& taken : listed(other, version)) std::erase(codes, taken);
  return codes;
}

std::span<const Version2Types> version2_types() {
  return kVersion2;
}

bool is_known_code(System system, std::string_view code, double version) {
  const std::span<const gnss::Signal> signals = gnss::signals_of(system);
  return std::any_of(signals.begin(), signals.end(), [&](const gnss::Signal& signal) {
    const std::vector<std::string> codes = listed(signal, version);
    return std::find(codes.begin(), codes.end(), code) != codes.end();
  });
}

std::optional<Eigen::Vector3d> ObservationHeader::antenna_ecef() const {
  if (moving || !approximate_position_ecef) return std::nullopt;
  const Eigen::Vector3d hen = antenna_delta_hen.value_or(Eigen::Vector3d::Zero());
  const Eigen::Matrix3d enu =
      geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(*approximate_position_ecef));
  return *approximate_position_ecef + enu.transpose() * Eigen::Vector3d(hen.y(), hen.z(), hen.x());
}

std::optional<HeaderRecords::Fault> HeaderRecords::begin(std::string_view line) {
  const std::string_view label = trim(column(line, kLabel, 20));
  if (label != "RINEX VERSION / TYPE") {
    return Fault{"is not a RINEX file: the first line is not 'RINEX VERSION / TYPE'",
                 "give a RINEX observation file, plain or gzip"};
  }
  const auto version = parse_double(column(line, 0, 9));
  if (!version || *version < 2 || *version >= 5) {
    return Fault{fmt::format("RINEX version '{}' is not supported", trim(column(line, 0, 9))),
                 "give version 2.x, 3.x or 4.x"};
  }
  header_.version = *version;
  header_.format = fmt::format("RINEX {:.2f}", *version);
  const std::string_view type = column(line, 20, 1);
  if (type != "O") {
    return Fault{fmt::format("is not an observation file (RINEX type '{}')", trim(column(line, 20, 20))),
                 type == "N" || type == "G" ? "this is a navigation file; give the receiver's observations"
                                            : "give a file of type O"};
  }
  const std::string_view system = column(line, 40, 1);
  header_.system = system.empty() || system == " " ? 'G' : system.front();
  // Files of one system use its own time scale by default.
  if (header_.system == 'R') header_.time_system = "GLO";
  if (header_.system == 'E') header_.time_system = "GAL";
  if (header_.system == 'C') header_.time_system = "BDT";
  if (header_.system == 'J') header_.time_system = "QZS";
  return std::nullopt;
}

HeaderRecords::Result HeaderRecords::apply(std::string_view line) {
  const std::string_view label = trim(column(line, kLabel, 20));
  if (label == "END OF HEADER") return {Outcome::End, {}};
  if (label == "# / TYPES OF OBSERV") return types2(line);
  if (label == "SYS / # / OBS TYPES") return types3(line);
  if (label == "SYS / SCALE FACTOR") return scale_factor(line);
  if (label == "GLONASS SLOT / FRQ #") return glonass_slots(line);
  if (label == "GLONASS COD/PHS/BIS") return glonass_biases(line);
  if (label == "TIME OF FIRST OBS") return time(line, true);
  if (label == "TIME OF LAST OBS") return time(line, false);
  if (label == "PGM / RUN BY / DATE") {
    header_.program = trim(column(line, 0, 20));
  } else if (label == "MARKER NAME") {
    header_.marker = trim(column(line, 0, 60));
  } else if (label == "REC # / TYPE / VERS") {
    header_.receiver = trim(column(line, 20, 20));
  } else if (label == "ANT # / TYPE") {
    header_.antenna = trim(column(line, 20, 20));
  } else if (label == "APPROX POSITION XYZ") {
    const auto position = three_numbers(line);
    if (!position) return damaged("APPROX POSITION XYZ is not three numbers");
    header_.approximate_position_ecef.reset();
    constexpr double kLowest_m = 6.3e6, kHighest_m = 5e7;
    const double radius_m = position->norm();
    if (radius_m == 0) return {};
    if (radius_m < kLowest_m || radius_m > kHighest_m)
      return damaged(fmt::format("APPROX POSITION XYZ is {:.0f} km from the Earth's centre", radius_m / 1e3));
    header_.approximate_position_ecef = position;
  } else if (label == "ANTENNA: DELTA H/E/N") {
    const auto delta = three_numbers(line);
    if (!delta) return damaged("ANTENNA: DELTA H/E/N is not three numbers");
    header_.antenna_delta_hen = delta;
  } else if (label == "INTERVAL") {
    const auto interval = parse_double(column(line, 0, 10));
    if (!interval || !(*interval >= 0)) return damaged("INTERVAL is not a number");
    header_.interval_s.reset();
    if (*interval > 0) header_.interval_s = interval;
  } else if (label == "RCV CLOCK OFFS APPL") {
    const auto flag = parse_integer(column(line, 0, 6));
    if (!flag || *flag < 0 || *flag > 1) return damaged("RCV CLOCK OFFS APPL is neither 0 nor 1");
    header_.clock_offset_applied = *flag == 1;
  } else if (label == "LEAP SECONDS") {
    const auto leap = parse_integer(column(line, 0, 6));
    if (!leap || *leap < 0 || *leap > 99) return damaged("LEAP SECONDS is not a number from 0 to 99");
    header_.leap_seconds = static_cast<int>(*leap);
  } else {
    return {Outcome::Unknown, {}};
  }
  return {};
}

HeaderRecords::Result HeaderRecords::types2(std::string_view line) {
  if (const std::string_view number = trim(column(line, 0, 6)); !number.empty()) {
    const auto count = parse_integer(number);
    if (!count || *count < 1 || *count > 99) return fatal("number of observation types is damaged");
    types_wanted_ = static_cast<std::size_t>(*count);
    header_.types[' '].clear();
  }
  std::vector<std::string>& types = header_.types[' '];
  for (std::size_t i = 0; i < 9 && types.size() < types_wanted_; ++i) {
    const std::string_view type = trim(column(line, 6 + 6 * i, 6));
    if (type.size() != 2) return fatal("a type of observation is missing or damaged");
    types.emplace_back(type);
  }
  return {};
}

HeaderRecords::Result HeaderRecords::types3(std::string_view line) {
  if (!line.empty() && line[0] != ' ') {
    const auto count = parse_integer(column(line, 3, 3));
    if (!count || *count < 0 || *count > 999) return fatal("number of observation types is damaged");
    types_wanted_ = static_cast<std::size_t>(*count);
    types_system_ = line[0] == 'Q' ? gnss::letter(gnss::System::QZSS) : line[0];
    header_.types[types_system_].clear();
  } else if (types_system_ == 0) {
    return fatal("observation types without a system");
  }
  std::vector<std::string>& types = header_.types[types_system_];
  for (std::size_t i = 0; i < 13 && types.size() < types_wanted_; ++i) {
    const std::string_view type = trim(column(line, 6 + 4 * i, 4));
    // Two letters: the attribute of an unknown code is blank.
    if (type.size() < 2 || type.size() > 3) return fatal("a type of observation is missing or damaged");
    types.emplace_back(type);
  }
  return {};
}

HeaderRecords::Result HeaderRecords::scale_factor(std::string_view line) {
  if (!line.empty() && line[0] != ' ') {
    const auto factor = parse_integer(column(line, 2, 4));
    const std::string_view number = trim(column(line, 8, 2));
    const auto count = number.empty() ? 0 : parse_integer(number).value_or(-1);
    if (!factor || *factor < 1 || count < 0) return fatal("scale factor is damaged");
    factor_system_ = line[0];
    factor_ = static_cast<double>(*factor);
    factor_wanted_ = static_cast<std::size_t>(count);
    if (count == 0) {
      factors_[factor_system_].clear();
      factors_[factor_system_][""] = factor_;  // all types
    }
  }
  for (std::size_t i = 0; i < 12 && factor_wanted_ > 0; ++i, --factor_wanted_) {
    const std::string_view type = trim(column(line, 10 + 4 * i, 4));
    if (type.empty()) return fatal("scale factor without its types of observation");
    factors_[factor_system_][std::string(type)] = factor_;
  }
  return {};
}

double HeaderRecords::factor(char system, const std::string& type) const {
  const auto system_entry = factors_.find(system);
  if (system_entry == factors_.end()) return 1;
  auto found = system_entry->second.find(type);
  if (found == system_entry->second.end()) found = system_entry->second.find("");
  return found == system_entry->second.end() ? 1 : found->second;
}

HeaderRecords::Result HeaderRecords::glonass_slots(std::string_view line) {
  for (std::size_t i = 0; i < 8; ++i) {
    const std::string_view slot = column(line, 4 + 7 * i, 6);
    if (trim(slot).empty()) break;
    const auto id = gnss::parse_satellite(column(slot, 0, 3));
    const auto channel = parse_integer(column(slot, 3, 3));
    if (!id || id->system != gnss::System::GLONASS || !channel || std::abs(*channel) > 13)
      return damaged("GLONASS SLOT / FRQ # is damaged");
    header_.glonass_channels[*id] = static_cast<int>(*channel);
  }
  return {};
}

HeaderRecords::Result HeaderRecords::glonass_biases(std::string_view line) {
  for (std::size_t i = 0; i < 4; ++i) {
    const std::string_view type = trim(column(line, 1 + 13 * i, 3)),
                           metres = trim(column(line, 5 + 13 * i, 8));
    if (type.empty() || metres.empty()) continue;
    const auto bias_m = parse_double(metres);
    if (!bias_m || type.size() != 3) return damaged("GLONASS COD/PHS/BIS is damaged");
    header_.glonass_bias_m[std::string(type.substr(1))] = *bias_m;
  }
  return {};
}

HeaderRecords::Result HeaderRecords::time(std::string_view line, bool first) {
  const std::string_view system = trim(column(line, 48, 3));
  if (!system.empty()) {
    if (!is_time_system(system)) return fatal(fmt::format("time system '{}' is unknown", system));
    if (first) header_.time_system = system;
  }
  constexpr TimeColumns kColumns{{{0, 6}, {6, 6}, {12, 6}, {18, 6}, {24, 6}, {30, 13}}};
  const auto t = time_in(line, kColumns, system.empty() ? header_.time_system : system);
  if (!t) return damaged("time in the header is not a time");
  (first ? header_.first : header_.last) = t;
  return {};
}

}  // namespace canyon::rinex
