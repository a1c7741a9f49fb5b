#pragma once

// Functions missing in emscripten 3.1.6, for one thread and a file system used by one program.
#include <atomic>
#include <cerrno>
#include <cstdio>

#define RENAME_NOREPLACE 1U
#define RENAME_EXCHANGE 2U
inline int renameat2(int, const char* from, int, const char* to, unsigned flags) {
  if (flags != RENAME_EXCHANGE) return std::rename(from, to);
  errno = EINVAL;
  return -1;
}

namespace std {
template <typename T>
struct atomic_ref {
  explicit atomic_ref(T& value) : value_(&value) {}
  T load(memory_order) const { return *value_; }
  void store(T value, memory_order) const { *value_ = value; }

 private:
  T* value_;
};
}  // namespace std
