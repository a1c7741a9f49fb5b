#include "canyon/sky/rinex/observation_fields.hpp"

#include <algorithm>
#include <utility>

#include "canyon/base/text.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"

namespace canyon::rinex {

namespace {

/// Where the parts of an epoch line stand.
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
  if (!event && parse_field(column(line, at.clock.begin, at.clock.width), offset) == Field::Number) {
    result.clock_offset_s = offset;
  }
  return result;
}

}  // namespace

bool is_blank(std::string_view text) {
  return text.find_first_not_of(' ') == std::string_view::npos;
}

Field parse_field(std::string_view text, double& value) {
  static constexpr double kPowers[] = {1,   1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                       1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  std::size_t i = 0;
  while (i < text.size() && text[i] == ' ') ++i;
  if (i == text.size()) return Field::Blank;
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
    return Field::Number;
  }
  const auto parsed = parse_double(text.substr(begin));
  if (!parsed) return lower_case(trim(text)) == "nan" ? Field::Blank : Field::Bad;
  value = *parsed;
  return Field::Number;
}

// RINEX 2.11, table A2: 1X,I2.2,4(1X,I2),F11.7,2X,I1,I3,12(A1,I2),F12.9
std::optional<EpochLine> epoch_line2(std::string_view line, std::string_view time_system) {
  // Blanks stand where a satellite's observations have digits.
  if (line.size() < 29 || line[0] != ' ' || line[3] != ' ' || line[6] != ' ' || line[9] != ' ' ||
      line[12] != ' ' || !is_blank(line.substr(26, 2))) {
    return std::nullopt;
  }
  constexpr TimeColumns kTime{{{1, 2}, {3, 3}, {6, 3}, {9, 3}, {12, 3}, {15, 11}}};
  return epoch_fields(line, {kTime, 28, {68, 12}}, time_system);
}

// RINEX 3.05, table A3: '>',1X,I4,4(1X,I2.2),F11.7,2X,I1,I3,6X,F15.12
std::optional<EpochLine> epoch_line3(std::string_view line, std::string_view time_system) {
  if (line.empty() || line[0] != '>') return std::nullopt;
  constexpr TimeColumns kTime{{{2, 4}, {6, 3}, {9, 3}, {12, 3}, {15, 3}, {18, 11}}};
  return epoch_fields(line, {kTime, 31, {41, 15}}, time_system);
}

namespace {

using gnss::System;

/// Version 2 does not say which component was tracked: X, but I of BeiDou, whose pilots came later. 2.12 (A
/// for C/A, B for L1C, C for L2C, D for GLONASS's C/A of L2) took 2 away from L2C.
constexpr double k212 = 2.115, k3 = 3;
constexpr Version2Types kVersion2[] = {
    {"GRJS", "1C", "CA", 'A', k212, k3}, {"GRJES", "1C", "C1", '1', 0, k3}, {"GRJ", "1P", "P1", '1', 0, k3},
    {"GJ", "1X", "CB", 'B', k212, k3},   {"GJ", "2X", "CC", 'C', k212, k3}, {"GJ", "2X", "C2", '2', 0, k212},
    {"R", "2C", "CD", 'D', k212, k3},    {"R", "2C", "C2", '2', 0, k3},     {"R", "2P", "P2", '2', 0, k3},
    {"G", "2W", "P2", '2', 0, k3},       {"GJES", "5X", "C5", '5', 0, k3},  {"E", "7X", "C7", '7', 0, k3},
    {"C", "2I", "C2", '2', k212, k3},    {"C", "2I", "C1", '1', 0, k212},   {"C", "7I", "C7", '7', 0, k3},
    {"C", "6I", "C6", '6', 0, k3},       {"EJ", "6X", "C6", '6', 0, k3},    {"E", "8X", "C8", '8', 0, k3},
};

/// 3.02 alone calls the band of B1I 1, which is B1C's everywhere else.
bool calls_b1i_band1(System system, double version) {
  return system == System::BeiDou && version > 3.015 && version < 3.025;
}

std::vector<std::string> listed(const gnss::Signal& signal, double version) {
  const bool b1i_band1 = calls_b1i_band1(signal.system, version);
  if (b1i_band1 && signal.code.front() == '1') return {};
  std::vector<std::string> codes{std::string(signal.code)};
  for (const std::string_view code : split_blanks(signal.also_read)) codes.emplace_back(code);
  if (b1i_band1 && signal.code.front() == '2') codes.insert(codes.end(), {"1X", "1Q"});
  return codes;
}

}  // namespace

std::vector<std::string> default_codes(System system, double version) {
  return listed(gnss::signals_of(system).front(), version);
}

std::vector<std::string> signal_codes(const gnss::Signal& signal, double version) {
  std::vector<std::string> codes = listed(signal, version);
  if (gnss::index_of(signal) > 0) return codes;
  for (const gnss::Signal& other : gnss::signals_of(signal.system).subspan(1)) {
    for (const std::string& taken : listed(other, version)) std::erase(codes, taken);
  }
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

}  // namespace canyon::rinex
