#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace canyon::cli {

/// A progress line on standard error: a bar that redraws itself on a terminal, otherwise a plain line every
/// few seconds, and nothing for work that ends sooner.
class Progress {
 public:
  Progress(std::string what, bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(std::size_t done, std::size_t total);

 private:
  using Clock = std::chrono::steady_clock;

  std::string what_;
  bool quiet_;
  bool terminal_;
  bool drawn_ = false;
  Clock::time_point begin_ = Clock::now();
  Clock::time_point last_line_ = Clock::now();
};

}  // namespace canyon::cli
