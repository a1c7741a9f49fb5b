#pragma once

#include <fmt/format.h>

#include "canyon/base/input_error.hpp"

namespace canyon::simulation {

inline constexpr int kMostThreads = 4096;

/// Throws InputError unless `threads` is 0 (as many as cores) to kMostThreads.
inline void check_threads(int threads) {
  if (threads >= 0 && threads <= kMostThreads) return;
  throw InputError(fmt::format("{} threads are out of range", threads),
                   fmt::format("give 0 (as many as cores) to {}", kMostThreads));
}

}  // namespace canyon::simulation
