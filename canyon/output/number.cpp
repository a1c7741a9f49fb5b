#include "canyon/output/number.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace canyon::output {

void append_fixed(std::string& text, double value, int decimals) {
  if (!std::isfinite(value)) return;
  const std::size_t begin = text.size();
  fmt::format_to(std::back_inserter(text), "{:.{}f}", value, decimals);
  if (text[begin] == '-' && text.find_first_not_of("-0.", begin) == std::string::npos) text.erase(begin, 1);
}

std::string fixed(double value, int decimals) {
  std::string text;
  append_fixed(text, value, decimals);
  return text;
}

std::string seconds_of_week(geodesy::GpsTime t, int min_decimals) {
  const std::int64_t ns = t.nanosecond_of_week();
  std::string text = fmt::format("{}.{:09d}", ns / geodesy::GpsTime::kNanosecondsPerSecond,
                                 ns % geodesy::GpsTime::kNanosecondsPerSecond);
  const std::size_t shortest = text.size() - 9 + static_cast<std::size_t>(std::clamp(min_decimals, 0, 9));
  while (text.size() > shortest && text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

}  // namespace canyon::output
