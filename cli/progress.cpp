#include "cli/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <utility>

namespace canyon::cli {

Progress::Progress(std::string what, bool quiet)
    : what_(std::move(what)), quiet_(quiet), terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (drawn_) fmt::print(stderr, "\r\033[K");
}

void Progress::update(std::size_t done, std::size_t total) {
  if (quiet_ || total == 0) return;
  const Clock::time_point now = Clock::now();
  const double elapsed_s = std::chrono::duration<double>(now - begin_).count();
  const double share = static_cast<double>(done) / static_cast<double>(total);
  const std::string left =
      done > 0 && done < total ? fmt::format(", {:.0f} s left", elapsed_s * (1 - share) / share) : "";
  if (terminal_) {
    constexpr int kWidth = 32;
    const int filled = static_cast<int>(share * kWidth);
    fmt::print(stderr, "\r\033[K{} [{}{}] {:3.0f} % ({} of {}{})", what_,
               std::string(static_cast<std::size_t>(filled), '#'),
               std::string(static_cast<std::size_t>(kWidth - filled), '.'), share * 100, done, total, left);
    std::fflush(stderr);
    drawn_ = true;
  } else if (now - last_line_ >= std::chrono::seconds(5)) {
    fmt::print(stderr, "{}: {} of {} ({:.0f} %{})\n", what_, done, total, share * 100, left);
    last_line_ = now;
  }
}

}  // namespace canyon::cli
