#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

struct gzFile_s;

namespace canyon {

/// The bytes of a file, unpacked where it is packed by gzip, by bzip2, by compress (.Z) or as the one file of
/// a zip archive (recognised by content, not by name), without UTF-8's byte order mark. Text in UTF-16 behind
/// its mark is given in UTF-8.
class GzipFile {
 public:
  /// Throws InputError as check_input_file() does, where the file is unreadable, packed in another way, or a
  /// web page.
  explicit GzipFile(std::filesystem::path path);

  /// The next bytes into `to`; returns how many, 0 at the end. Throws InputError, at `line` of the text,
  /// where the packed data are damaged or unpack to absurd sizes. Data that end early are not an error: see
  /// cut_short().
  [[nodiscard]] std::size_t read(char* to, std::size_t size, int line);
  /// Whether the packed data ended before their end mark; known once read() has returned 0.
  [[nodiscard]] bool cut_short() const { return cut_short_; }

 private:
  std::size_t read_some(char* to, std::size_t size, int line);
  std::size_t read_unpacked(char* to, std::size_t size, int line);

  std::filesystem::path path_;
  std::unique_ptr<gzFile_s, int (*)(gzFile_s*)> file_;
  std::uint64_t size_ = 0;      ///< of the file
  std::uint64_t unpacked_ = 0;  ///< bytes so far
  std::string ready_;           ///< bytes that read() gives next
  std::size_t given_ = 0;       ///< of these
  std::optional<Utf16Decoder> utf16_;
  bool cut_short_ = false;
};

/// All bytes of a file, unpacked as GzipFile does. Throws InputError as it does, for packed data that end
/// early and for more than `max_bytes`.
[[nodiscard]] std::string read_bytes(const std::filesystem::path& path,
                                     std::size_t max_bytes = std::size_t{1} << 31);

/// The largest file that a reader takes unless it says otherwise [bytes].
inline constexpr std::uint64_t kLargestFile = std::uint64_t{1} << 38;

/// Notes a file in InputFiles. Throws InputError as that does, and unless `path` is a regular file (not a
/// folder, and not a pipe or device, which may never end) of at most `largest` bytes. Every reader calls it
/// before it opens a file.
void check_input_file(const std::filesystem::path& path, std::uint64_t largest = kLargestFile);

/// The first bytes of a file as it lies there; fewer where it is shorter, none where it cannot be read.
[[nodiscard]] std::string read_head(const std::filesystem::path& path, std::size_t bytes);

/// A larger file that grows by more than `kMostGrowth` as it is unpacked is refused.
inline constexpr std::uint64_t kHarmlessSize = std::uint64_t{1} << 28;
inline constexpr std::uint64_t kMostGrowth = 200;
/// Files that are unpacked as a whole have no more bytes, packed and unpacked.
inline constexpr std::size_t kLargestUnpacked = std::size_t{1} << 30;

/// Whether a file that begins so is of gzip, of bzip2, or a zip archive.
[[nodiscard]] bool is_gzip(std::string_view head);
[[nodiscard]] bool is_bzip2(std::string_view head);
[[nodiscard]] bool is_zip(std::string_view head);

/// Whether the whole file must be there to unpack it here: of bzip2, of Unix compress (.Z), or a zip archive.
[[nodiscard]] bool is_unpacked_whole(std::string_view head);
/// Throws InputError for the first bytes of what cannot be read here: other archives, and web pages, which
/// servers send instead of data where one must sign in.
void refuse_foreign_bytes(const std::filesystem::path& path, std::string_view head);

}  // namespace canyon
