#pragma once

#include <cstdint>

namespace canyon {

/// a / b, rounded down. @param b > 0
[[nodiscard]] constexpr std::int64_t floor_div(std::int64_t a, std::int64_t b) {
  return a / b - (a % b < 0 ? 1 : 0);
}

}  // namespace canyon
