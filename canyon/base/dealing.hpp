#pragma once

#include <cstddef>
#include <functional>
#include <mutex>
#include <utility>

namespace canyon {

/// Deals 0, 1, 2, ... to the threads of one process, and where `next` counts over several processes to all of
/// theirs: each number once, in order of asking, so that whoever is free takes what is left. Thread-safe.
class Dealing {
 public:
  /// @param next the next number over all processes, asked from one thread at a time; empty: counts by itself
  explicit Dealing(std::function<std::size_t()> next = {}) : next_(std::move(next)) {}

  [[nodiscard]] std::size_t take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return next_ ? next_() : own_++;
  }

 private:
  std::mutex mutex_;
  std::function<std::size_t()> next_;
  std::size_t own_ = 0;
};

}  // namespace canyon
