#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>

#include "canyon/base/input_error.hpp"

struct gzFile_s;

namespace canyon {

/// The bytes of a file, unpacked where it is gzip-compressed (recognised by content, not by name).
class GzipFile {
 public:
  /// Throws InputError where the file is missing, a folder or unreadable.
  explicit GzipFile(std::filesystem::path path);

  /// The next bytes into `to`; returns how many, 0 at the end. Throws InputError, at `line` of the text,
  /// where the packed data are damaged. Data that end early are not an error: see cut_short().
  [[nodiscard]] std::size_t read(char* to, std::size_t size, int line);
  /// Whether the packed data ended before their end mark; known once read() has returned 0.
  [[nodiscard]] bool cut_short() const { return cut_short_; }

 private:
  std::filesystem::path path_;
  std::unique_ptr<gzFile_s, int (*)(gzFile_s*)> file_;
  bool cut_short_ = false;
};

}  // namespace canyon
