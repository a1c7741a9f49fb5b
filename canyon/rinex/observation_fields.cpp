#include "canyon/rinex/observation_fields.hpp"

#include <algorithm>
#include <utility>

#include "canyon/base/text.hpp"

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

}  // namespace canyon::rinex
