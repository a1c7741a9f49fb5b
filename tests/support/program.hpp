#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <stdexcept>
#include <string>

namespace canyon::test {

struct ProgramResult {
  int status = -1;     ///< exit status; -1 if a signal ended it
  std::string output;  ///< standard output
};

/// Runs a command line of sh.
inline ProgramResult run_program(const std::string& command_line) {
  std::FILE* pipe = popen(command_line.c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error("cannot run " + command_line);
  ProgramResult result;
  std::array<char, 4096> buffer{};
  while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe)) {
    result.output.append(buffer.data(), n);
  }
  const int status = pclose(pipe);
  if (WIFEXITED(status)) result.status = WEXITSTATUS(status);
  return result;
}

inline bool has_program(const std::string& name) {
  return run_program("command -v " + name + " 2>/dev/null").status == 0;
}

}  // namespace canyon::test

/// Skips the test with a message if a program needed for its check is not installed.
#define CANYON_NEEDS_PROGRAM(name)                                               \
  if (!::canyon::test::has_program(name)) {                                      \
    GTEST_SKIP() << "SKIPPED: the judge " << (name) << " is not installed here"; \
  }                                                                              \
  static_assert(true, "needs a semicolon")
