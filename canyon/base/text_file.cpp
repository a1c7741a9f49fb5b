#include "canyon/base/text_file.hpp"

#include <algorithm>

#include "canyon/base/gzip_file.hpp"

namespace canyon {

TextFile::TextFile(const std::filesystem::path& path, std::size_t max_bytes, CutGzip cut) : path_(path) {
  GzipFile file(path);
  char buffer[1 << 16];
  while (const std::size_t n = file.read(buffer, sizeof buffer, 0)) {
    text_.append(buffer, n);
    if (text_.size() > max_bytes) {
      throw InputError(path, 0, "holds more than " + std::to_string(max_bytes >> 20) + " MiB of text",
                       "is it the right file?");
    }
  }
  if (!file.cut_short()) return;
  if (cut == CutGzip::Refuse) {
    throw InputError(path, 0, "gzip data is damaged or cut short", "fetch the file again");
  }
  // Half a line may read as another number.
  text_.resize(text_.rfind('\n') + 1);
  const auto lines = std::count(text_.begin(), text_.end(), '\n');
  cut_warning_ = GzipFile::cut_warning(path, static_cast<int>(lines)).what();
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
