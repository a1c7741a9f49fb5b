#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace canyon {

/// Bad input from outside (file, scenario, command line, caller's pose): the only exception type that
/// Canyon throws on purpose. `what()` is one line for a person, "FILE:LINE: problem; cure", with the
/// parts that are not known left out. The CLI prints it and exits 2.
class InputError : public std::runtime_error {
 public:
  /// @param problem what is wrong, with the offending value
  /// @param cure what to do about it; may be empty
  explicit InputError(std::string_view problem, std::string_view cure = {});

  /// @param line 1-based; 0 where the fault belongs to the whole file
  InputError(const std::filesystem::path& file, int line, std::string_view problem,
             std::string_view cure = {});

  [[nodiscard]] const std::string& file() const { return file_; }
  [[nodiscard]] int line() const { return line_; }
  [[nodiscard]] const std::string& problem() const { return problem_; }
  [[nodiscard]] const std::string& cure() const { return cure_; }

 private:
  std::string file_;
  int line_ = 0;
  std::string problem_;
  std::string cure_;
};

/// A text for people with "..." for each password of an address in it, also where its scheme is missing or
/// misspelt, and for the values of keys such as "api_key", "token" and "password" in its query, of addresses
/// also for all values of eight letters and more: "ntrip://user:...@host:2101/MOUNT" for
/// "ntrip://user:p@ss/word@host:2101/MOUNT". An address ends with a blank or a quotation mark, in quotation
/// marks with the second one. Where an explanation writes USER:PASSWORD it stays. InputError does so with its
/// problem and cure.
[[nodiscard]] std::string hide_passwords(std::string_view text);

}  // namespace canyon
