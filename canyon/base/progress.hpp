#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <functional>
#include <mutex>

namespace canyon {

/// Counts finished items of work, from any thread, and reports them to a callback.
class Progress {
 public:
  /// @param callback gets the finished and the total number of items; may be empty; must outlive this
  Progress(const std::function<void(std::size_t, std::size_t)>& callback, std::size_t total)
      : callback_(callback), total_(total) {}

  /// Counts `items` as finished; reports at most ten times a second.
  void add(std::size_t items) {
    if (!callback_) return;
    const std::lock_guard lock(mutex_);
    done_ += items;
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    callback_(done_, std::max(done_, total_));
  }
  /// Reports at any time.
  void report() {
    if (!callback_) return;
    const std::lock_guard lock(mutex_);
    callback_(done_, std::max(done_, total_));
  }

 private:
  const std::function<void(std::size_t, std::size_t)>& callback_;
  std::size_t total_, done_ = 0;
  std::mutex mutex_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace canyon
