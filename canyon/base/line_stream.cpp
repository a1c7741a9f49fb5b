#include "canyon/base/line_stream.hpp"

#include <zlib.h>

#include <cassert>
#include <cerrno>
#include <cstring>
#include <system_error>

namespace canyon {

struct LineStream::Source {
  std::unique_ptr<gzFile_s, int (*)(gzFile)> file{nullptr, &gzclose};
  bool ended = false;
};

LineStream::LineStream() = default;
LineStream::~LineStream() = default;
LineStream::LineStream(LineStream&&) noexcept = default;
LineStream& LineStream::operator=(LineStream&&) noexcept = default;

LineStream::LineStream(std::filesystem::path path)
    : path_(std::move(path)), source_(std::make_unique<Source>()) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path_, ignored)) {
    throw InputError(path_, 0, "is a folder, not a file", "give a file");
  }
  errno = 0;
  source_->file.reset(gzopen(path_.c_str(), "rb"));
  if (!source_->file) {
    const int code = errno;
    throw InputError(path_, 0,
                     code == ENOENT
                         ? std::string("no such file")
                         : std::string("cannot be opened: ") + std::strerror(code != 0 ? code : EIO),
                     code == ENOENT ? "check the path" : "");
  }
  gzbuffer(source_->file.get(), 1U << 17U);
}

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
  while (end == std::string::npos && source_ && !source_->ended) {
    searched = buffer_.size() - begin_;
    buffer_.erase(0, begin_);
    begin_ = 0;
    if (buffer_.size() > kLongestLine) break;
    char chunk[1 << 15];
    const int n = gzread(source_->file.get(), chunk, sizeof chunk);
    int code = Z_OK;
    const char* detail = gzerror(source_->file.get(), &code);
    // zlib reports a stream that stops early only after the last byte, as Z_BUF_ERROR.
    if (n < 0 || code == Z_BUF_ERROR || code == Z_DATA_ERROR) {
      throw InputError(path_, line_, std::string("gzip data is damaged or cut short here (") + detail + ")",
                       "fetch the file again");
    }
    if (n == 0) source_->ended = true;
    buffer_.append(chunk, static_cast<std::size_t>(n));
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

void LineStream::unread() {
  assert(!again_ && line_ > 0);
  again_ = true;
  --line_;
}

}  // namespace canyon
