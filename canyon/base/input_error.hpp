#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace canyon {

/// Base of the exceptions that Canyon throws on purpose: InputError and OutputError. `what()` is one line for
/// the user, "FILE:LINE: problem; hint", without the parts that are unknown. The CLI prints it.
class Error : public std::runtime_error {
 public:
  /// @param problem what is wrong, with the offending value
  /// @param hint how to fix it; may be empty
  explicit Error(std::string_view problem, std::string_view hint = {});

  /// @param line 1-based; 0 if the fault concerns the whole file
  Error(const std::filesystem::path& file, int line, std::string_view problem, std::string_view hint = {});

  [[nodiscard]] const std::string& file() const { return file_; }
  [[nodiscard]] int line() const { return line_; }
  [[nodiscard]] const std::string& problem() const { return problem_; }
  [[nodiscard]] const std::string& hint() const { return hint_; }

 private:
  std::string file_;
  int line_ = 0;
  std::string problem_;
  std::string hint_;
};

/// Bad input from outside: file, scenario, command line, caller's pose. The CLI exits 2.
class InputError : public Error {
 public:
  using Error::Error;
};

/// The machine cannot store an output: a full disk, a quota, a disk that is gone. The CLI exits 1, because
/// the input is not to blame.
class OutputError final : public Error {
 public:
  using Error::Error;
};

/// Replaces by "..." each password of an address, also if its scheme is missing or misspelt, and the values
/// of query keys such as "api_key", "token" and "password"; in addresses also all values of eight letters and
/// more: "ntrip://user:...@host:2101/MOUNT" for "ntrip://user:p@ss/word@host:2101/MOUNT". An address ends at
/// a blank or a quotation mark; in quotation marks, at the closing one. The placeholder USER:PASSWORD of
/// explanations is kept. Error applies this function to its problem and hint.
[[nodiscard]] std::string hide_passwords(std::string_view text);

}  // namespace canyon
