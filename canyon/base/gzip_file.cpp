#include "canyon/base/gzip_file.hpp"

#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>
#include <utility>

#include "canyon/base/input_files.hpp"
#include "canyon/base/unpack.hpp"

namespace canyon {
namespace {

constexpr std::size_t kHead = 512;  // bytes to detect the kind of a file: tar's mark is at 257
constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
constexpr std::size_t kUtf16Mark = 2;  // bytes

using namespace std::string_view_literals;

/// Overpass sends error pages in XHTML.
bool is_web_page(std::string_view head) {
  std::string text = lower_case(trim(head.substr(0, 256)));
  if (text.starts_with("<?xml")) text = trim(text.substr(std::min(text.find("?>"), text.size() - 2) + 2));
  return text.starts_with("<!doctype html") || text.starts_with("<html");
}

/// A format that cannot be read: its mark, the mark's offset, and the hint.
struct Refused {
  std::string_view mark;
  std::size_t at;
  std::string_view name, hint;
};
constexpr Refused kRefused[] = {{"\xfd"
                                 "7zXZ\0"sv,
                                 0, "packed by xz", "unpack it first (unxz)"},
                                {"\x28\xb5\x2f\xfd", 0, "packed by Zstandard", "unpack it first (unzstd)"},
                                {"7z\xbc\xaf\x27\x1c", 0, "packed by 7-Zip", "unpack it first (7z x)"},
                                {"Rar!\x1a\x07", 0, "packed by RAR", "unpack it first (unrar)"},
                                {"ustar", 257, "a tar archive", "unpack it and name one of its files"},
                                {"version https://git-lfs", 0, "a pointer of Git LFS, not the data",
                                 "run git lfs pull in its repository"}};

}  // namespace

GzipFile::GzipFile(std::filesystem::path path) : path_(std::move(path)), file_(nullptr, &gzclose) {
  check_input_file(path_);
  std::error_code ignored;
  size_ = std::filesystem::file_size(path_, ignored);
  errno = 0;
  file_.reset(gzopen(path_.c_str(), "rb"));
  if (!file_) {
    const int code = errno;
    throw InputError(path_, 0, std::string("cannot be opened: ") + std::strerror(code != 0 ? code : EIO));
  }
  gzbuffer(file_.get(), 1U << 17U);
  ready_.resize(kHead);
  try {
    ready_.resize(read_some(ready_.data(), kHead, 0));
  } catch (const InputError&) {
    // read() gets the same error and reports it.
    ready_.clear();
    gzrewind(file_.get());
  }
  if (is_unpacked_whole(ready_)) {
    check_input_file(path_, kMaxUnpacked);
    std::string packed(size_, '\0');
    std::copy(ready_.begin(), ready_.end(), packed.begin());
    for (std::size_t at = ready_.size(); at < packed.size();) {
      const std::size_t n =
          read_some(packed.data() + at, std::min<std::size_t>(packed.size() - at, 1U << 30U), 0);
      if (n == 0) packed.resize(at);
      at += n;
    }
    ready_ = unpack(path_, packed);
  }
  const std::string_view head = std::string_view(ready_).substr(0, kHead);
  if (head.substr(0, kByteOrderMark.size()) == kByteOrderMark) given_ = kByteOrderMark.size();
  refuse_foreign_bytes(path_, head.substr(given_));
  if (Utf16Decoder::is_marked(head)) {
    utf16_.emplace(head);
    std::string text;
    utf16_->append(std::string_view(ready_).substr(kUtf16Mark), text);
    declare_utf8(text);
    ready_ = std::move(text);
    refuse_foreign_bytes(path_, ready_);
  }
}

std::size_t GzipFile::read(char* to, std::size_t size, int line) {
  while (utf16_ && given_ == ready_.size()) {
    char bytes[1 << 15];
    const std::size_t n = read_unpacked(bytes, sizeof bytes, line);
    if (n == 0) return 0;
    ready_.clear();
    given_ = 0;
    utf16_->append({bytes, n}, ready_);
  }
  if (given_ < ready_.size()) {
    const std::size_t n = ready_.copy(to, size, given_);
    given_ += n;
    return n;
  }
  return read_unpacked(to, size, line);
}

std::size_t GzipFile::read_unpacked(char* to, std::size_t size, int line) {
  const std::size_t n = read_some(to, size, line);
  unpacked_ += n;
  if (unpacked_ > kHarmlessSize && unpacked_ / kMaxGrowth > size_) {
    throw InputError(path_, line, "unpacks to more than " + std::to_string(kMaxGrowth) + " times its size",
                     "is it the right file?");
  }
  return n;
}

std::size_t GzipFile::read_some(char* to, std::size_t size, int line) {
  const int n = gzread(file_.get(), to, static_cast<unsigned>(size));
  int code = Z_OK;
  const char* detail = gzerror(file_.get(), &code);
  // For a truncated stream zlib returns all that it could unpack, then Z_BUF_ERROR.
  if (code == Z_BUF_ERROR) {
    cut_short_ = true;
  } else if (n < 0 || code == Z_DATA_ERROR) {
    throw InputError(path_, line, std::string("gzip data are damaged or cut short here (") + detail + ")",
                     "fetch the file again");
  }
  return static_cast<std::size_t>(n < 0 ? 0 : n);
}

std::string read_bytes(const std::filesystem::path& path, std::size_t max_bytes) {
  GzipFile file(path);
  std::string bytes;
  char buffer[1 << 16];
  while (const std::size_t n = file.read(buffer, sizeof buffer, 0)) {
    bytes.append(buffer, n);
    if (bytes.size() > max_bytes) {
      throw InputError(path, 0, "has more than " + std::to_string(max_bytes >> 20) + " MiB",
                       "is it the right file?");
    }
  }
  if (file.cut_short())
    throw InputError(path, 0, "gzip data are damaged or cut short", "fetch the file again");
  return bytes;
}

void check_input_file(const std::filesystem::path& path, std::uint64_t largest) {
  std::error_code code;
  const std::filesystem::file_status status = std::filesystem::status(path, code);
  if (status.type() == std::filesystem::file_type::not_found)
    throw InputError(path, 0, "no such file", "check the path (paths in a file start at that file's folder)");
  if (status.type() == std::filesystem::file_type::none)
    throw InputError(path, 0, "cannot be opened: " + code.message());
  if (std::filesystem::is_directory(status)) throw InputError(path, 0, "is a folder, not a file");
  if (!std::filesystem::is_regular_file(status))
    throw InputError(path, 0, "is a pipe or a device, not a regular file", "save its output to a file");
  const std::uintmax_t size = std::filesystem::file_size(path, code);
  if (!code && size > largest) {
    throw InputError(path, 0, "is larger than " + std::to_string(largest >> 20) + " MiB",
                     "is it the right file?");
  }
  InputFiles::current().add(path);
}

std::string read_head(const std::filesystem::path& path, std::size_t bytes) {
  std::ifstream in(path, std::ios::binary);
  std::string head(bytes, '\0');
  in.read(head.data(), static_cast<std::streamsize>(bytes));
  head.resize(static_cast<std::size_t>(in.gcount()));
  return head;
}

void refuse_foreign_bytes(const std::filesystem::path& path, std::string_view head) {
  for (const Refused& kind : kRefused)
    if (head.size() > kind.at && head.substr(kind.at, kind.mark.size()) == kind.mark)
      throw InputError(path, 0, "is " + std::string(kind.name), kind.hint);
  if (is_web_page(head)) {
    throw InputError(path, 0, "is a web page (HTML), not data",
                     "the server may require a login: open the address in a browser, then fetch it again");
  }
}

bool is_gzip(std::string_view head) {
  return head.substr(0, 2) == "\x1f\x8b"sv;
}
bool is_bzip2(std::string_view head) {
  return head.size() > 3 && head.substr(0, 3) == "BZh" && head[3] >= '1' && head[3] <= '9';
}
bool is_zip(std::string_view head) {
  return head.substr(0, 4) == "PK\x03\x04"sv;
}

bool is_unpacked_whole(std::string_view head) {
  const bool compress = head.starts_with("\x1f\x9d");
  return is_bzip2(head) || compress || is_zip(head);
}

}  // namespace canyon
