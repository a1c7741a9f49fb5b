#pragma once

#include <atomic>
#include <cstdlib>
#include <new>

// Counts allocations of the program that includes this, in one file alone: it replaces operator new. Not with
// sanitizers, which bring their own; CANYON_COUNTS_ALLOCATIONS says whether it does.

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define CANYON_COUNTS_ALLOCATIONS 1

// GCC cannot see that new and delete below match.
#if defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 11
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
#endif

namespace canyon::test {
inline std::atomic<long> allocations{0};
}

void* operator new(std::size_t size) {
  ++canyon::test::allocations;
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept {
  std::free(p);
}
void operator delete(void* p, std::size_t) noexcept {
  std::free(p);
}

#endif
