#include "canyon/base/text_file.hpp"

#include <algorithm>

#include "canyon/base/text.hpp"

namespace canyon {
namespace {

/// Whether the lines of a text end with carriage returns alone, as written by old spreadsheets. Bytes with
/// other control characters are not text.
bool has_lone_returns(std::string_view text) {
  const auto is_no_text = [](char c) {
    return static_cast<unsigned char>(c) < ' ' && c != '\r' && c != '\t' && c != '\f';
  };
  return text.find('\r') != std::string_view::npos && std::none_of(text.begin(), text.end(), is_no_text);
}

/// Replaces the carriage returns of a text by line feeds from `from` on; one before a line feed stays.
void end_lines(std::string& text, std::size_t from) {
  for (std::size_t at = text.find('\r', from); at != std::string::npos; at = text.find('\r', at + 1))
    if (at + 1 == text.size() || text[at + 1] != '\n') text[at] = '\n';
}

}  // namespace

TextFile::TextFile(const std::filesystem::path& path, std::size_t max_bytes, CutGzip cut) : path_(path) {
  GzipFile file(path);
  char buffer[1 << 16];
  while (const std::size_t n = file.read(buffer, sizeof buffer, 0)) {
    text_.append(buffer, n);
    if (text_.size() > max_bytes) {
      throw InputError(path, 0, "has more than " + std::to_string(max_bytes >> 20) + " MiB of text",
                       "is it the right file?");
    }
  }
  if (has_lone_returns(text_)) end_lines(text_, 0);
  if (!file.cut_short()) return;
  if (cut == CutGzip::Refuse)
    throw InputError(path, 0, "gzip data are damaged or cut short", "fetch the file again");
  // Drops the last line: half a line may parse as another number.
  text_.resize(text_.rfind('\n') + 1);
  note_cut(static_cast<int>(std::count(text_.begin(), text_.end(), '\n')));
}

TextFile TextFile::streamed(const std::filesystem::path& path) {
  TextFile file;
  file.path_ = path;
  file.rest_.emplace(path);
  return file;
}

TextFile TextFile::from_string(std::string text, std::filesystem::path name) {
  TextFile file;
  file.text_ = utf8_of_marked(std::move(text));
  file.path_ = std::move(name);
  if (has_lone_returns(file.text_)) end_lines(file.text_, 0);
  return file;
}

void TextFile::note_cut(int line) {
  cut_warning_ = InputError(path_, line, "the gzip data end early", "read up to here; fetch the file again");
}

std::optional<std::string_view> TextFile::peek_line() {
  std::size_t searched = position_;
  end_ = text_.find('\n', searched);
  while (end_ == std::string::npos && rest_ && text_.size() - position_ <= kMaxLine) {
    text_.erase(0, position_);
    position_ = 0;
    searched = text_.size();
    char chunk[1 << 15];
    const std::size_t n = rest_->read(chunk, sizeof chunk, line_);
    text_.append(chunk, n);
    // The first piece decides for the whole file: a later one may consist of a single long line.
    if (first_piece_) lone_returns_ = has_lone_returns(text_.substr(0, text_.size() - 1));
    first_piece_ = false;
    if (lone_returns_) {
      // A line feed after the last carriage return belongs to it.
      if (n > 0 && text_.back() == '\r') text_.append(chunk, rest_->read(chunk, 1, line_));
      end_lines(text_, searched);
    }
    if (n == 0) {
      if (rest_->cut_short()) {
        text_.clear();  // half a line may parse as another number
        note_cut(line_);
      }
      rest_.reset();
    }
    end_ = text_.find('\n', searched);
  }
  if (position_ >= text_.size()) return std::nullopt;
  end_ = std::min(end_, text_.size());
  if (rest_ && end_ - position_ > kMaxLine)
    throw InputError(path_, line_ + 1, "line of more than 64 KiB", "this is not a text file");
  std::string_view line = std::string_view(text_).substr(position_, end_ - position_);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

std::optional<std::string_view> TextFile::next_line() {
  const std::optional<std::string_view> line = peek_line();
  if (!line) return line;
  last_ = position_;
  position_ = std::min(end_ + 1, text_.size());
  ++line_;
  return line;
}

}  // namespace canyon
