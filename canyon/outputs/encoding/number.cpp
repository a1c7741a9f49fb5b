#include "canyon/outputs/encoding/number.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>

namespace canyon::encoding {
namespace {

/// `value` times 10^`decimals`, rounded to the nearest: exact if the product is far from the middle of two
/// integers and fits into the digits of a double; else empty. @param value not negative
std::optional<std::uint64_t> scaled(double value, int decimals) {
  constexpr std::array kPowers{1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                               1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  if (decimals < 0 || static_cast<std::size_t>(decimals) >= kPowers.size()) return std::nullopt;
  const double power = kPowers.at(static_cast<std::size_t>(decimals)), product = value * power;
  if (!(product < 4e15)) return std::nullopt;
  const auto whole = static_cast<std::int64_t>(product);
  // Includes the rounding error of the product.
  const double rest = product - static_cast<double>(whole) + std::fma(value, power, -product);
  if (std::abs(rest - 0.5) < 1e-6) return std::nullopt;
  return static_cast<std::uint64_t>(whole + (rest > 0.5 ? 1 : 0));
}

/// `number` / 10^`decimals`, of at most 15 decimals.
void append_decimal(std::string& text, std::uint64_t number, std::size_t decimals) {
  const fmt::format_int digits(number);
  const std::size_t zeros = digits.size() > decimals ? 0 : decimals + 1 - digits.size();
  const std::size_t before = zeros > 0 ? 1 : digits.size() - decimals;
  std::array<char, 48> line{};
  // Leaves one character for the decimal point.
  std::fill_n(line.begin() + 1, zeros, '0');
  std::copy_n(digits.data(), digits.size(), line.begin() + 1 + static_cast<std::ptrdiff_t>(zeros));
  std::copy_n(line.begin() + 1, before, line.begin());
  line.at(before) = '.';
  text.append(line.data(), before + (decimals > 0 ? 1 + decimals : 0));
}

}  // namespace

void append_fixed(std::string& text, double value, int decimals) {
  if (!std::isfinite(value)) return;
  if (const auto number = scaled(std::abs(value), decimals)) {
    if (value < 0 && *number != 0) text.push_back('-');
    append_decimal(text, *number, static_cast<std::size_t>(decimals));
    return;
  }
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
  std::string text;
  append_decimal(text, static_cast<std::uint64_t>(ns), 9);
  const std::size_t shortest = text.size() - 9 + static_cast<std::size_t>(std::clamp(min_decimals, 0, 9));
  while (text.size() > shortest && text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

}  // namespace canyon::encoding
