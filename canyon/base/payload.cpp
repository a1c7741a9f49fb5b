#include "canyon/base/payload.hpp"

#include <algorithm>
#include <cmath>

#include "canyon/base/arithmetic.hpp"

namespace canyon {

Payload& Payload::put(std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) bytes_ += static_cast<char>(value >> (8 * i) & 0xFF);
  return *this;
}

Payload& Payload::unsigned_field(double value, double step, int bytes) {
  const double steps = std::round(value / step);
  const double maximum = std::ldexp(1.0, 8 * bytes) - 1;
  return put(std::isnan(steps) ? 0 : static_cast<std::uint64_t>(std::clamp(steps, 0.0, maximum)), bytes);
}

Payload& Payload::signed_field(double value, double step, int bytes) {
  const double steps = std::round(value / step);
  const double end = std::ldexp(1.0, 8 * bytes - 1);
  const double held = std::isnan(steps) ? 0 : std::clamp(steps, -end, end - 1);
  return put(static_cast<std::uint64_t>(static_cast<std::int64_t>(held)), bytes);
}

Payload& Payload::r4(float value) {
  return put(same_bytes<std::uint32_t>(value), 4);
}

Payload& Payload::r8(double value) {
  return put(same_bytes<std::uint64_t>(value), 8);
}

Payload& Payload::zeros(std::size_t bytes) {
  bytes_.append(bytes, '\0');
  return *this;
}

Payload& Payload::text(std::string_view text, std::size_t size) {
  bytes_ += text.substr(0, size);
  return zeros(size - std::min(size, text.size()));
}

Payload& Payload::raw(std::string_view bytes) {
  bytes_ += bytes;
  return *this;
}

namespace {

constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

}  // namespace

std::string base64(std::string_view bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k)
      word = word << 8 | (k < n ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= n ? kDigits[word >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

std::optional<std::string> from_base64(std::string_view text) {
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  for (const char c : text) {
    const std::size_t value = kDigits.find(c);
    if (value == std::string_view::npos) return std::nullopt;
    bits = bits << 6U | static_cast<std::uint32_t>(value);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> static_cast<unsigned>(count) & 0xFFU);
  }
  return bytes;
}

}  // namespace canyon
