#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "canyon/base/input_error.hpp"

namespace canyon {

/// What becomes of a gzip-compressed file that ends early.
enum class CutGzip : std::uint8_t {
  Refuse,    ///< for texts that are whole or useless: YAML, JSON
  ReadToCut  ///< for lists of records: the lines that are whole, with TextFile::cut_warning()
};

/// The lines of a whole text file, plain or gzip-compressed (recognised by content, not by name), with the
/// place of each for error messages. CR before LF is dropped.
class TextFile {
 public:
  /// Reads the file. Throws InputError where it is missing, a folder, unreadable, over `max_bytes` unpacked,
  /// or (gzip) damaged or, with CutGzip::Refuse, cut short.
  explicit TextFile(const std::filesystem::path& path, std::size_t max_bytes = std::size_t{1} << 31,
                    CutGzip cut = CutGzip::Refuse);

  /// A file that is already in memory; `name` stands for its path in messages.
  [[nodiscard]] static TextFile from_string(std::string text, std::filesystem::path name);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::string_view text() const { return text_; }
  /// "FILE:LINE: the gzip data end early ..." where they did; else empty.
  [[nodiscard]] const std::string& cut_warning() const { return cut_warning_; }

  /// The next line without its end, or nothing at the end of the file.
  [[nodiscard]] std::optional<std::string_view> next_line();
  /// 1-based number of the line that next_line() gave last; 0 before the first.
  [[nodiscard]] int line() const { return line_; }
  /// The line that next_line() would give, without taking it.
  [[nodiscard]] std::optional<std::string_view> peek_line() const;

  /// An InputError at the current line.
  [[nodiscard]] InputError error(std::string_view problem, std::string_view cure = {}) const {
    return InputError(path_, line_, problem, cure);
  }

 private:
  TextFile() = default;

  std::filesystem::path path_;
  std::string text_;
  std::string cut_warning_;
  std::size_t position_ = 0;
  int line_ = 0;
};

}  // namespace canyon
