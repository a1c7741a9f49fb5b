#include "canyon/base/gzip_file.hpp"

#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

namespace canyon {

GzipFile::GzipFile(std::filesystem::path path) : path_(std::move(path)), file_(nullptr, &gzclose) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path_, ignored)) {
    throw InputError(path_, 0, "is a folder, not a file");
  }
  errno = 0;
  file_.reset(gzopen(path_.c_str(), "rb"));
  if (!file_) {
    const int code = errno;
    throw InputError(path_, 0,
                     code == ENOENT
                         ? "no such file"
                         : std::string("cannot be opened: ") + std::strerror(code != 0 ? code : EIO),
                     code == ENOENT ? "check the path (relative paths start at the scenario's folder)" : "");
  }
  gzbuffer(file_.get(), 1U << 17U);
}

std::size_t GzipFile::read(char* to, std::size_t size, int line) {
  const int n = gzread(file_.get(), to, static_cast<unsigned>(size));
  int code = Z_OK;
  const char* detail = gzerror(file_.get(), &code);
  // zlib gives all that it could unpack of a stream that stops early, and then Z_BUF_ERROR.
  if (code == Z_BUF_ERROR) {
    cut_short_ = true;
  } else if (n < 0 || code == Z_DATA_ERROR) {
    throw InputError(path_, line, std::string("gzip data is damaged or cut short here (") + detail + ")",
                     "fetch the file again");
  }
  return static_cast<std::size_t>(n < 0 ? 0 : n);
}

}  // namespace canyon
