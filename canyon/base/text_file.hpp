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
  Refuse,    ///< for texts that are useless unless complete: YAML, JSON
  ReadToCut  ///< for lists of records: reads the complete lines, with TextFile::cut_warning()
};

/// The lines of a text file in UTF-8, plain or gzip-compressed (recognised by content, not by name), with
/// line numbers for error messages. CR before LF is dropped; in a text without LF, CR ends the lines. All
/// text files are opened by this class.
class TextFile {
 public:
  /// Limit of a line in a streamed file; a longer line is rejected [bytes].
  static constexpr std::size_t kMaxLine = std::size_t{1} << 16;

  /// Reads the whole file. Throws InputError if it is missing, a folder, unreadable, over `max_bytes`
  /// unpacked, or (gzip) damaged or, with CutGzip::Refuse, cut short.
  explicit TextFile(const std::filesystem::path& path, std::size_t max_bytes = std::size_t{1} << 31,
                    CutGzip cut = CutGzip::Refuse);
  /// Reads the file in pieces, in constant memory: recordings of a day at 10 Hz have gigabytes. A line is
  /// valid until the next call. Truncated gzip data are read up to the cut. Throws InputError if the file is
  /// missing, a folder or unreadable; next_line() and peek_line() throw it for damaged gzip data and for a
  /// line above kMaxLine.
  [[nodiscard]] static TextFile streamed(const std::filesystem::path& path);
  /// A text that is already in memory; `name` is its path in messages.
  [[nodiscard]] static TextFile from_string(std::string text, std::filesystem::path name);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// All of the text; not of a streamed file.
  [[nodiscard]] std::string_view text() const { return text_; }
  /// "FILE:LINE: the gzip data end early ..." if they did. For a streamed file valid only after its end.
  [[nodiscard]] const std::optional<InputError>& cut_warning() const { return cut_warning_; }

  /// The next line without its end, or nothing at the end of the file.
  [[nodiscard]] std::optional<std::string_view> next_line();
  /// 1-based number of the last line from next_line(); 0 before the first.
  [[nodiscard]] int line() const { return line_; }
  /// The line that next_line() would return, without consuming it.
  [[nodiscard]] std::optional<std::string_view> peek_line();
  /// Puts back the last line. Precondition: the previous call was a next_line() that returned a line.
  void unread_line() {
    position_ = last_;
    --line_;
  }

  /// An InputError at the current line.
  [[nodiscard]] InputError error(std::string_view problem, std::string_view hint = {}) const {
    return InputError(path_, line_, problem, hint);
  }

 private:
  TextFile() = default;

  void note_cut(int line);

  std::filesystem::path path_;
  std::optional<GzipFile> rest_;  ///< part of a streamed file that is not yet in text_
  std::string text_;
  std::optional<InputError> cut_warning_;
  std::size_t position_ = 0;  ///< of the next line in text_
  std::size_t end_ = 0;       ///< of the last line from peek_line()
  std::size_t last_ = 0;      ///< begin of the last line from next_line()
  int line_ = 0;
  bool first_piece_ = true;    ///< of a streamed file
  bool lone_returns_ = false;  ///< lines end with carriage returns alone
};

}  // namespace canyon
