#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <vector>

#include "gnss.pb.h"

namespace canyon::test {

/// The messages published by a receiver, in order. They arrive in any thread.
class GnssLog {
 public:
  void add(const msgs::GnssReceiver& message) {
    const std::lock_guard lock(mutex_);
    messages_.push_back(message);
    arrived_.notify_all();
  }
  /// The first message at or after a simulated time; empty after `deadline`.
  std::optional<msgs::GnssReceiver> at(double sim_time_s,
                                       std::chrono::seconds deadline = std::chrono::seconds(10)) {
    std::unique_lock lock(mutex_);
    std::optional<msgs::GnssReceiver> found;
    arrived_.wait_for(lock, deadline, [&] {
      for (const msgs::GnssReceiver& message : messages_) {
        if (static_cast<double>(message.sim_time_ns()) * 1e-9 < sim_time_s - 1e-9) continue;
        found = message;
        return true;
      }
      return false;
    });
    return found;
  }
  std::vector<msgs::GnssReceiver> all() {
    const std::lock_guard lock(mutex_);
    return messages_;
  }
  void clear() {
    const std::lock_guard lock(mutex_);
    messages_.clear();
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<msgs::GnssReceiver> messages_;
};

}  // namespace canyon::test
