#pragma once

#include <cstring>
#include <type_traits>

namespace canyon {

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
