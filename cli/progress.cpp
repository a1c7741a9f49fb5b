#include "cli/progress.hpp"

#include <fmt/format.h>

#include <unistd.h>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <utility>

#include "canyon/base/input_error.hpp"

namespace canyon::cli {

std::string short_count(double count) {
  constexpr std::array<const char*, 6> kPrefixes{"", " k", " M", " G", " T", " P"};
  std::size_t i = 0;
  // 999.5 would be printed as 1000.
  while (count >= 999.5 && i + 1 < kPrefixes.size()) {
    count /= 1000;
    ++i;
  }
  if (i == 0) return fmt::format("{:.0f}", count);
  return fmt::format("{:.{}f}{}", count, count < 9.995 ? 2 : count < 99.95 ? 1 : 0, kPrefixes[i]);
}

std::string duration_text(double seconds) {
  if (!(seconds < 1e9)) return "very long";
  const auto whole = static_cast<long long>(std::llround(seconds));
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
  if (whole < 86'400) return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
  return fmt::format("{} d {} h", whole / 86'400, whole % 86'400 / 3600);
}

void note(bool quiet, const std::string& text) {
  if (quiet) return;
  std::fflush(stdout);
  fmt::print(stderr, "{}\n", hide_passwords(text));
}

ProgressLine::ProgressLine(std::string what, bool quiet, std::string unit)
    : what_(std::move(what)), unit_(std::move(unit)), quiet_(quiet), terminal_(isatty(STDERR_FILENO) == 1) {}

ProgressLine::~ProgressLine() {
  if (rendered_) fmt::print(stderr, "\r\033[K");
}

void ProgressLine::update(std::size_t done, std::size_t total) {
  if (quiet_ || total == 0) return;
  const Clock::time_point now = Clock::now();
  if (!found_) found_ = unit_.empty() ? 0 : done;
  const bool bar_due = terminal_ && (done == total || now - last_bar_ >= std::chrono::milliseconds(50));
  const bool line_due = !terminal_ && now - last_line_ >= std::chrono::seconds(5);
  if (!bar_due && !line_due) return;

  const double elapsed_s = std::chrono::duration<double>(now - begin_).count();
  const double fraction = static_cast<double>(done) / static_cast<double>(total);
  const auto worked = static_cast<double>(done - *found_);
  std::string about = unit_.empty() ? fmt::format("{} of {}", done, total)
                                    : fmt::format("{} of {} {}", short_count(static_cast<double>(done)),
                                                  short_count(static_cast<double>(total)), unit_);
  if (worked > 0 && elapsed_s > 0) {
    if (!unit_.empty()) about += fmt::format(", {}/s", short_count(worked / elapsed_s));
    if (done < total) {
      about +=
          fmt::format(", {} left", duration_text(elapsed_s * static_cast<double>(total - done) / worked));
    }
  }
  if (terminal_) {
    constexpr int kWidth = 32;
    const int filled = static_cast<int>(fraction * kWidth);
    fmt::print(stderr, "\r\033[K{} [{}{}] {:3.0f} % ({})", what_,
               std::string(static_cast<std::size_t>(filled), '#'),
               std::string(static_cast<std::size_t>(kWidth - filled), '.'), fraction * 100, about);
    std::fflush(stderr);
    rendered_ = true;
    last_bar_ = now;
  } else {
    fmt::print(stderr, "{}: {:.0f} % ({})\n", what_, fraction * 100, about);
    last_line_ = now;
  }
}

namespace {

std::atomic<bool> interrupt_seen{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set from a signal handler");

extern "C" void request_stop(int signal) {
  interrupt_seen = true;
  // A second Ctrl-C ends the program at once.
  std::signal(signal, SIG_DFL);
}

}  // namespace

const std::atomic<bool>& catch_interrupts() {
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  // nohup ignores it.
  if (std::signal(SIGHUP, request_stop) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
  return interrupt_seen;
}

}  // namespace canyon::cli
