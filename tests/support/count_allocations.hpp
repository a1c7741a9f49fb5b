#pragma once

#include <atomic>
#include <cstdlib>

// Counts allocations of the program, if included in exactly one file: replaces malloc, which operator new and
// Eigen call. Not with sanitizers, which have their own; CANYON_COUNTS_ALLOCATIONS is defined if it counts.

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && defined(__GLIBC__)
#define CANYON_COUNTS_ALLOCATIONS 1

namespace canyon::test {
inline std::atomic<long> allocations{0};
}

extern "C" {
void* __libc_malloc(std::size_t size);  // NOLINT(bugprone-reserved-identifier): glibc's
void* malloc(std::size_t size) noexcept {
  ++canyon::test::allocations;
  return __libc_malloc(size);
}
}

#endif
