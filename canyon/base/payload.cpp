#include "canyon/base/payload.hpp"

#include <algorithm>
#include <cmath>

#include "canyon/base/same_bytes.hpp"

namespace canyon {

Payload& Payload::put(std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) bytes_ += static_cast<char>(value >> (8 * i) & 0xFF);
  return *this;
}

Payload& Payload::unsigned_field(double value, double step, int bytes) {
  const double steps = std::round(value / step);
  const double most = std::ldexp(1.0, 8 * bytes) - 1;
  return put(std::isnan(steps) ? 0 : static_cast<std::uint64_t>(std::clamp(steps, 0.0, most)), bytes);
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

}  // namespace canyon
