#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace canyon::cli {

/// Takes the output of a program that runs without the user's terminal.
struct ProgramOutput {
  std::filesystem::path complaints;            ///< a file for its standard error
  std::function<void(std::string_view)> line;  ///< called with each line that it prints
};

/// A program in the search path.
[[nodiscard]] bool is_installed(const std::string& program);

/// Runs a program to its end and returns its exit status, 128 if a signal ended it. Throws InputError
/// if it cannot be started. @param output empty: it has the terminal of this program
int run_program(const std::vector<std::string>& words, const ProgramOutput& output = {});

/// Runs a user's program: without standard input, its output on standard error. It and what it has started
/// end when it ends, after `timeout_s`, and on Ctrl-C, which throws Interrupted. Returns why it failed:
/// "the program ended with status 3"; empty: it did not. Throws InputError if it cannot be started.
std::string run_bounded(const std::vector<std::string>& words, double timeout_s);

}  // namespace canyon::cli
