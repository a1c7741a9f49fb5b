#include "canyon/base/output_file.hpp"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

namespace canyon {
namespace {

constexpr std::string_view kCure = "choose a folder that exists and that you may write to";

bool is_the_machine(int code) {
  return code == ENOSPC || code == EDQUOT || code == EIO || code == EMFILE || code == ENFILE;
}

}  // namespace

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)) {
  temporary_ = path_;
  temporary_ += ".part" + std::to_string(getpid());
  errno = 0;
  file_ = std::fopen(temporary_.c_str(), "wb");
  if (file_ == nullptr) {
    if (is_the_machine(errno)) fail("cannot be written");
    throw InputError(path_, 0, std::string("cannot be written: ") + std::strerror(errno), kCure);
  }
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_(std::exchange(other.temporary_, {})),
      file_(std::exchange(other.file_, nullptr)) {}

OutputFile::~OutputFile() {
  if (file_ != nullptr) std::fclose(file_);
  if (!temporary_.empty()) {
    std::error_code ignored;
    std::filesystem::remove(temporary_, ignored);
  }
}

void OutputFile::fail(std::string_view what) const {
  const int code = errno;
  throw OutputError(path_, 0, std::string(what) + ": " + std::strerror(code != 0 ? code : EIO),
                    code == ENOSPC                     ? "free disk space and run again"
                    : code == EMFILE || code == ENFILE ? "allow more open files (ulimit -n)"
                                                       : "");
}

void OutputFile::write(std::string_view bytes) {
  errno = 0;
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail("cannot be written");
}

void OutputFile::overwrite(std::size_t offset, std::string_view bytes) {
  errno = 0;
  if (std::fseek(file_, static_cast<long>(offset), SEEK_SET) != 0) fail("cannot be written");
  write(bytes);
  if (std::fseek(file_, 0, SEEK_END) != 0) fail("cannot be written");
}

void OutputFile::commit() {
  errno = 0;
  const bool flushed = std::fflush(file_) == 0;
  const bool closed = std::fclose(std::exchange(file_, nullptr)) == 0;
  if (!flushed || !closed) fail("cannot be written");
  std::error_code error;
  std::filesystem::rename(temporary_, path_, error);
  if (error) throw InputError(path_, 0, "cannot be put in place: " + error.message());
  temporary_.clear();
}

void write_file(const std::filesystem::path& path, std::string_view bytes) {
  OutputFile file(path);
  file.write(bytes);
  file.commit();
}

void make_output_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw InputError(folder, 0, "folder cannot be made: " + error.message(), kCure);
  }
  const OutputFile probe(folder / ".canyon-probe");
}

}  // namespace canyon
