#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

struct gzFile_s;

namespace canyon {

/// The bytes of a file without UTF-8's byte order mark. Unpacks gzip, bzip2, compress (.Z) and zip archives
/// with one file, recognised by content. UTF-16 text with a byte order mark is converted to UTF-8.
class GzipFile {
 public:
  /// Throws InputError as check_input_file() does, for an unreadable file, another packing and a web page.
  explicit GzipFile(std::filesystem::path path);

  /// Reads the next bytes into `to`; returns their number, 0 at the end. Throws InputError, at `line` of the
  /// text, if the packed data are damaged or unpack to an implausible size. Truncated data are no error: see
  /// cut_short().
  [[nodiscard]] std::size_t read(char* to, std::size_t size, int line);
  /// Whether the packed data ended before their end mark; valid once read() has returned 0.
  [[nodiscard]] bool cut_short() const { return cut_short_; }

 private:
  std::size_t read_some(char* to, std::size_t size, int line);
  std::size_t read_unpacked(char* to, std::size_t size, int line);

  std::filesystem::path path_;
  std::unique_ptr<gzFile_s, int (*)(gzFile_s*)> file_;
  std::uint64_t size_ = 0;      ///< of the file
  std::uint64_t unpacked_ = 0;  ///< bytes so far
  std::string ready_;           ///< bytes that read() returns next
  std::size_t given_ = 0;       ///< returned bytes of `ready_`
  std::optional<Utf16Decoder> utf16_;
  bool cut_short_ = false;
};

/// All bytes of a file, unpacked as by GzipFile. Throws InputError like GzipFile, for truncated packed data
/// and for more than `max_bytes`.
[[nodiscard]] std::string read_bytes(const std::filesystem::path& path,
                                     std::size_t max_bytes = std::size_t{1} << 31);

/// The default limit of a reader for the size of a file [bytes].
inline constexpr std::uint64_t kMaxFile = std::uint64_t{1} << 38;

/// Adds a file to InputFiles. Throws InputError as InputFiles does, and unless `path` is a regular file (no
/// folder, no pipe or device, which may never end) of at most `largest` bytes. Every reader calls it before
/// opening a file.
void check_input_file(const std::filesystem::path& path, std::uint64_t largest = kMaxFile);

/// The first bytes of a file, not unpacked; fewer if the file is shorter, none if it is unreadable.
[[nodiscard]] std::string read_head(const std::filesystem::path& path, std::size_t bytes);

/// A larger file that expands by more than `kMaxGrowth` when unpacked is rejected.
inline constexpr std::uint64_t kHarmlessSize = std::uint64_t{1} << 28;
inline constexpr std::uint64_t kMaxGrowth = 200;
/// Limit for files that are unpacked as a whole, packed and unpacked size [bytes].
inline constexpr std::size_t kMaxUnpacked = std::size_t{1} << 30;

/// Whether `head` is the beginning of a gzip file, a bzip2 file or a zip archive.
[[nodiscard]] bool is_gzip(std::string_view head);
[[nodiscard]] bool is_bzip2(std::string_view head);
[[nodiscard]] bool is_zip(std::string_view head);

/// Whether unpacking needs the whole file in memory: bzip2, Unix compress (.Z) and zip archives.
[[nodiscard]] bool is_unpacked_whole(std::string_view head);
/// Throws InputError if the first bytes are those of an unsupported archive, or of a web page: servers send
/// one instead of data if a login is required.
void refuse_foreign_bytes(const std::filesystem::path& path, std::string_view head);

}  // namespace canyon
