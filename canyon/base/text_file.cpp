#include "canyon/base/text_file.hpp"

#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <system_error>

namespace canyon {

TextFile::TextFile(const std::filesystem::path& path, std::size_t max_bytes) : path_(path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    throw InputError(path, 0, "is a folder, not a file");
  }
  errno = 0;
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> file(gzopen(path.c_str(), "rb"), &gzclose);
  if (!file) {
    throw InputError(path, 0,
                     errno == ENOENT
                         ? "no such file"
                         : std::string("cannot be opened: ") + std::strerror(errno != 0 ? errno : EIO),
                     errno == ENOENT ? "check the path (relative paths start at the scenario's folder)" : "");
  }
  char buffer[1 << 16];
  for (;;) {
    const int n = gzread(file.get(), buffer, sizeof buffer);
    int code = Z_OK;
    const char* detail = gzerror(file.get(), &code);
    // zlib reports a stream that stops early only after the last byte, as Z_BUF_ERROR.
    if (n < 0 || code == Z_BUF_ERROR || code == Z_DATA_ERROR) {
      throw InputError(path, 0, std::string("gzip data is damaged or cut short (") + detail + ")",
                       "fetch the file again");
    }
    if (n == 0) break;
    text_.append(buffer, static_cast<std::size_t>(n));
    if (text_.size() > max_bytes) {
      throw InputError(path, 0, "holds more than " + std::to_string(max_bytes >> 20) + " MiB of text",
                       "is it the right file?");
    }
  }
}

TextFile TextFile::from_string(std::string text, std::filesystem::path name) {
  TextFile file;
  file.text_ = std::move(text);
  file.path_ = std::move(name);
  return file;
}

std::optional<std::string_view> TextFile::peek_line() const {
  if (position_ >= text_.size()) return std::nullopt;
  std::string_view rest = std::string_view(text_).substr(position_);
  rest = rest.substr(0, rest.find('\n'));
  if (!rest.empty() && rest.back() == '\r') rest.remove_suffix(1);
  return rest;
}

std::optional<std::string_view> TextFile::next_line() {
  const std::optional<std::string_view> line = peek_line();
  if (!line) return line;
  const std::size_t end = text_.find('\n', position_);
  position_ = end == std::string::npos ? text_.size() : end + 1;
  ++line_;
  return line;
}

}  // namespace canyon
