#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>

namespace canyon::cli {

/// "950", "12.3 k", "1.77 M": three digits of a count.
[[nodiscard]] std::string short_count(double count);
/// "12 s", "3 min 20 s", "2 h 5 min", "4 d 3 h".
[[nodiscard]] std::string duration_text(double seconds);

/// Prints a line to standard error, in a log after the earlier output; nothing if `quiet`. Hides passwords of
/// addresses.
void note(bool quiet, const std::string& text);

/// Wall time.
[[nodiscard]] inline double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// A progress line on standard error: a bar that redraws itself on a terminal, otherwise a plain line every
/// few seconds, and nothing for work that ends earlier.
class ProgressLine {
 public:
  /// @param unit of the count, "cells": counts are then short, and the rate is shown. Items done before the
  /// first update count as found, not as work.
  ProgressLine(std::string what, bool quiet, std::string unit = {});
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void update(std::size_t done, std::size_t total);
  /// update() as a function object.
  [[nodiscard]] std::function<void(std::size_t, std::size_t)> callback() {
    return [this](std::size_t done, std::size_t total) { update(done, total); };
  }

 private:
  using Clock = std::chrono::steady_clock;

  std::string what_;
  std::string unit_;
  bool quiet_;
  bool terminal_;
  bool rendered_ = false;
  std::optional<std::size_t> found_;  ///< with a unit: done at the first update
  Clock::time_point begin_ = Clock::now();
  Clock::time_point last_line_ = Clock::now();
  Clock::time_point last_bar_;
};

/// Ctrl-C: thrown by callbacks, so that no incomplete file is written.
struct Interrupted {};

/// From now on Ctrl-C (SIGINT), SIGTERM and the end of the terminal (SIGHUP) set the returned flag instead of
/// ending the program; a second one ends it at once.
[[nodiscard]] const std::atomic<bool>& catch_interrupts();

}  // namespace canyon::cli
