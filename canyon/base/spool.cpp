#include "canyon/base/spool.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "canyon/base/output_file.hpp"

namespace canyon {
namespace {

[[noreturn]] void fail(int code) {
  throw OutputError(std::filesystem::temp_directory_path(), 0,
                    std::string("a temporary file cannot be kept there: ") + std::strerror(code),
                    "free disk space, or name another folder in TMPDIR");
}

std::FILE* open_nameless() {
  std::string name = std::filesystem::temp_directory_path() / "canyon-XXXXXX";
  const int handle = ::mkostemp(name.data(), O_CLOEXEC);
  if (handle < 0) fail(errno);
  ::unlink(name.c_str());
  return ::fdopen(handle, "w+b");
}

}  // namespace

void Spool::Text::add(std::string_view bytes) {
  rest_ += bytes;
  if (rest_.size() < kBlock) return;
  if (!spool_->file_) spool_->file_.reset(open_nameless());
  const int handle = ::fileno(spool_->file_.get());
  std::size_t at = 0;
  for (; rest_.size() - at >= kBlock; at += kBlock) {
    const auto place = static_cast<off_t>(spool_->blocks_) * static_cast<off_t>(kBlock);
    errno = 0;
    if (::pwrite(handle, rest_.data() + at, kBlock, place) != static_cast<ssize_t>(kBlock))
      fail(errno != 0 ? errno : ENOSPC);
    places_.push_back(spool_->blocks_++);
  }
  rest_.erase(0, at);
}

void Spool::Text::read(const std::function<void(std::string_view)>& put) const {
  std::string block(kBlock, '\0');
  for (const std::uint32_t each : places_) {
    const auto place = static_cast<off_t>(each) * static_cast<off_t>(kBlock);
    errno = 0;
    if (::pread(::fileno(spool_->file_.get()), block.data(), kBlock, place) != static_cast<ssize_t>(kBlock))
      fail(errno != 0 ? errno : EIO);
    put(block);
  }
  put(rest_);
}

}  // namespace canyon
