#pragma once

#include <cstdint>
#include <cstring>
#include <type_traits>

namespace canyon {

/// a / b, rounded down. @param b > 0
[[nodiscard]] constexpr std::int64_t floor_div(std::int64_t a, std::int64_t b) {
  return a / b - (a % b < 0 ? 1 : 0);
}

/// A value of another type with the same bytes: std::bit_cast, which GCC 10 has not.
template <typename To, typename From>
[[nodiscard]] To same_bytes(const From& from) {
  static_assert(sizeof(To) == sizeof(From) && std::is_trivially_copyable_v<To> &&
                std::is_trivially_copyable_v<From>);
  To to;
  std::memcpy(&to, &from, sizeof to);
  return to;
}

}  // namespace canyon

// Hot loops compiled with and without AVX2. The program selects one version at startup (needs glibc's
// indirect functions). Neither version uses fused multiplications, so both give the same bytes. Disabled
// under sanitizers: they instrument the resolver that selects a clone before they are initialised. Without
// AVX2 an epoch takes 1.5 times as long.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__GLIBC__) && \
    !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__)
#define CANYON_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define CANYON_CLONES
#endif
