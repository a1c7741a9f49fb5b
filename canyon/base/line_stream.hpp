#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "canyon/base/input_error.hpp"

namespace canyon {

class GzipFile;

/// The lines of a text file one after the other, plain or gzip-compressed (recognised by content), in memory
/// of constant size however long the file is: recordings of a day at 10 Hz hold gigabytes. CR before LF is
/// dropped.
class LineStream {
 public:
  /// A longer line belongs to no text file [bytes].
  static constexpr std::size_t kLongestLine = std::size_t{1} << 16;

  /// Throws InputError where the file is missing, a folder or unreadable.
  explicit LineStream(std::filesystem::path path);
  /// Text that is already in memory; `name` stands for its path in messages.
  [[nodiscard]] static LineStream from_string(std::string text, std::filesystem::path name);
  ~LineStream();
  LineStream(LineStream&&) noexcept;
  LineStream& operator=(LineStream&&) noexcept;

  /// The next line without its end, valid until the next call; nothing at the end, which is behind the last
  /// whole line where gzip data end early. Throws InputError for gzip data that is damaged, and for lines
  /// above kLongestLine.
  [[nodiscard]] std::optional<std::string_view> next();
  /// Lets next() give its last line once more. Only after a next() that gave one (asserted).
  void unread();
  /// 1-based number of the line that next() gave last; 0 before the first.
  [[nodiscard]] int line() const { return line_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Whether the gzip data ended early; known once next() has given nothing.
  [[nodiscard]] bool cut_short() const;

  /// An InputError at the current line.
  [[nodiscard]] InputError error(std::string_view problem, std::string_view cure = {}) const {
    return InputError(path_, line_, problem, cure);
  }

 private:
  LineStream();

  std::filesystem::path path_;
  std::unique_ptr<GzipFile> source_;  ///< null for text in memory
  bool ended_ = false;                ///< no more from there
  std::string buffer_;
  std::size_t begin_ = 0;        ///< of what next() has not given
  std::size_t last_ = 0;         ///< begin of the line that next() gave last
  std::size_t last_next_ = 0;    ///< and of the one behind it
  std::size_t last_length_ = 0;  ///< of that line, without its end
  bool again_ = false;
  int line_ = 0;
};

}  // namespace canyon
