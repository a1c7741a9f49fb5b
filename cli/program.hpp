#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace canyon::cli {

/// Destination of the output of a program that runs without the user's terminal.
struct ProgramOutput {
  std::filesystem::path complaints;            ///< file for its standard error
  std::function<void(std::string_view)> line;  ///< called with each line that it prints
};

/// A program in the search path.
[[nodiscard]] bool is_installed(const std::string& program);

/// Runs a program to its end and returns its exit status, 128 if a signal ended it. Throws InputError if it
/// cannot be started. @param output empty: the terminal of this program
int run_program(const std::vector<std::string>& words, const ProgramOutput& output = {});

/// Runs a user's program: without standard input, its output on standard error. It and its child processes
/// are killed when it ends, after `timeout_s`, and on Ctrl-C, which throws Interrupted. Returns the reason of
/// a failure: "the program ended with status 3"; empty: success. Throws InputError if it cannot be started.
std::string run_bounded(const std::vector<std::string>& words, double timeout_s);

}  // namespace canyon::cli
