#pragma once

#include <cstddef>
#include <functional>
#include <mutex>
#include <utility>

namespace canyon {

/// Distributes the indices 0, 1, 2, ... of work items over the threads of one process; with `next`, over all
/// threads of several processes. Each index is taken once, in order. Thread-safe.
class WorkQueue {
 public:
  /// @param next the next index over all processes, called by one thread at a time; empty: counts by itself
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
