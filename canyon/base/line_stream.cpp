#include "canyon/base/line_stream.hpp"

#include <cassert>
#include <utility>

#include "canyon/base/gzip_file.hpp"

namespace canyon {

LineStream::LineStream() = default;
LineStream::~LineStream() = default;
LineStream::LineStream(LineStream&&) noexcept = default;
LineStream& LineStream::operator=(LineStream&&) noexcept = default;

LineStream::LineStream(std::filesystem::path path)
    : path_(std::move(path)), source_(std::make_unique<GzipFile>(path_)) {}

LineStream LineStream::from_string(std::string text, std::filesystem::path name) {
  LineStream stream;
  stream.path_ = std::move(name);
  stream.buffer_ = std::move(text);
  return stream;
}

std::optional<std::string_view> LineStream::next() {
  if (again_) {
    again_ = false;
    begin_ = last_next_;
    ++line_;
    return std::string_view(buffer_).substr(last_, last_length_);
  }
  std::size_t searched = begin_;
  std::size_t end = buffer_.find('\n', searched);
  while (end == std::string::npos && source_ && !ended_) {
    searched = buffer_.size() - begin_;
    buffer_.erase(0, begin_);
    begin_ = 0;
    if (buffer_.size() > kLongestLine) break;
    char chunk[1 << 15];
    const std::size_t n = source_->read(chunk, sizeof chunk, line_);
    if (n == 0) {
      ended_ = true;
      // Half a line may read as another number.
      if (source_->cut_short()) buffer_.clear();
      break;
    }
    buffer_.append(chunk, n);
    end = buffer_.find('\n', searched);
  }
  if (begin_ >= buffer_.size()) return std::nullopt;
  last_ = begin_;
  last_next_ = end == std::string::npos ? buffer_.size() : end + 1;
  last_length_ = (end == std::string::npos ? buffer_.size() : end) - last_;
  if (last_length_ > kLongestLine) {
    throw InputError(path_, line_ + 1, "line of more than 64 KiB", "this is no text file");
  }
  if (last_length_ > 0 && buffer_[last_ + last_length_ - 1] == '\r') --last_length_;
  begin_ = last_next_;
  ++line_;
  return std::string_view(buffer_).substr(last_, last_length_);
}

bool LineStream::cut_short() const {
  return source_ && source_->cut_short();
}

void LineStream::unread() {
  assert(!again_ && line_ > 0);
  again_ = true;
  --line_;
}

}  // namespace canyon
