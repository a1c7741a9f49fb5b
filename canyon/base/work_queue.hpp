#pragma once

#include <cstddef>
#include <functional>
#include <mutex>
#include <utility>

namespace canyon {

/// A queue of work by its places 0, 1, 2, ..., for the threads of one process, and where `next` counts over
/// several processes for all of theirs: each place is taken once, in order. Thread-safe.
class WorkQueue {
 public:
  /// @param next the next place over all processes, asked from one thread at a time; empty: counts by itself
  explicit WorkQueue(std::function<std::size_t()> next = {}) : next_(std::move(next)) {}

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
