#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon {

/// How TextFile treats a gzip-compressed file that ends early.
enum class CutGzip : std::uint8_t {
  Refuse,    ///< for texts that are whole or useless: YAML, JSON
  ReadToCut  ///< for lists of records: the lines that are whole, with TextFile::cut_warning()
};

/// The lines of a text file, plain or gzip-compressed (recognised by content, not by name), with the place of
/// each for error messages, in UTF-8. CR before LF is dropped; CR alone ends the lines of a text without LF.
/// The one place that opens text files.
class TextFile {
 public:
  /// A longer line of a streamed file is refused [bytes].
  static constexpr std::size_t kLongestLine = std::size_t{1} << 16;

  /// Reads the whole file. Throws InputError where it is missing, a folder, unreadable, over `max_bytes`
  /// unpacked, or (gzip) damaged or, with CutGzip::Refuse, cut short.
  explicit TextFile(const std::filesystem::path& path, std::size_t max_bytes = std::size_t{1} << 31,
                    CutGzip cut = CutGzip::Refuse);
  /// Reads the file while its lines are taken, in memory of constant size however long it is: recordings of
  /// a day at 10 Hz hold gigabytes. A line is valid until the next call. Gzip data are read to a cut.
  /// Throws InputError where the file is missing, a folder or unreadable; next_line() and peek_line() throw
  /// it for damaged gzip data and for a line above kLongestLine.
  [[nodiscard]] static TextFile streamed(const std::filesystem::path& path);
  /// A file that is already in memory; `name` stands for its path in messages.
  [[nodiscard]] static TextFile from_string(std::string text, std::filesystem::path name);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// All of the text; not of a streamed file.
  [[nodiscard]] std::string_view text() const { return text_; }
  /// "FILE:LINE: the gzip data end early ..." where they did. A streamed file has it once next_line() has
  /// given nothing.
  [[nodiscard]] const std::optional<InputError>& cut_warning() const { return cut_warning_; }

  /// The next line without its end, or nothing at the end of the file.
  [[nodiscard]] std::optional<std::string_view> next_line();
  /// 1-based number of the line that next_line() gave last; 0 before the first.
  [[nodiscard]] int line() const { return line_; }
  /// The line that next_line() would give, without taking it.
  [[nodiscard]] std::optional<std::string_view> peek_line();
  /// Puts the line that next_line() gave last back. Only right after a next_line() that gave one.
  void unread_line() {
    position_ = last_;
    --line_;
  }

  /// An InputError at the current line.
  [[nodiscard]] InputError error(std::string_view problem, std::string_view cure = {}) const {
    return InputError(path_, line_, problem, cure);
  }

 private:
  TextFile() = default;

  void note_cut(int line);

  std::filesystem::path path_;
  std::optional<GzipFile> rest_;  ///< what a streamed file has not put into text_
  std::string text_;
  std::optional<InputError> cut_warning_;
  std::size_t position_ = 0;  ///< of the next line in text_
  std::size_t end_ = 0;       ///< of the line that peek_line() gave last
  std::size_t last_ = 0;      ///< begin of the line that next_line() gave last
  int line_ = 0;
  bool first_piece_ = true;    ///< of a streamed file
  bool lone_returns_ = false;  ///< carriage returns alone end its lines
};

}  // namespace canyon
