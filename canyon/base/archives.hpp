#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace canyon {

/// A larger file that grows by more than `kMostGrowth` as it is unpacked is refused.
inline constexpr std::uint64_t kHarmlessSize = std::uint64_t{1} << 28;
inline constexpr std::uint64_t kMostGrowth = 200;
/// Files that are unpacked as a whole have no more bytes, packed and unpacked.
inline constexpr std::size_t kLargestUnpacked = std::size_t{1} << 30;

/// Whether a file that begins so is of gzip, of bzip2, of Unix compress (.Z), or a zip archive.
[[nodiscard]] bool is_gzip(std::string_view head);
[[nodiscard]] bool is_bzip2(std::string_view head);
[[nodiscard]] bool is_compress(std::string_view head);
[[nodiscard]] bool is_zip(std::string_view head);

/// Whether the whole file must be there to unpack it here: true for all of these but gzip.
[[nodiscard]] bool is_unpacked_whole(std::string_view head);
/// Unpacks such a file. Throws InputError as the functions below, and for one that unpacks to more than 1
/// GiB, or to more than 256 MiB and 200 times its size.
[[nodiscard]] std::string unpack(const std::filesystem::path& path, std::string_view packed);

/// The streams of bzip2, one or several. Throws InputError, in the name of `path`, where the data are
/// damaged, and above `largest` bytes.
[[nodiscard]] std::string unpack_bzip2(const std::filesystem::path& path, std::string_view packed,
                                       std::size_t largest);
/// Unpacks the LZW of compress 4.0: codes of 9 to 16 bits, the least significant bit first, in groups of
/// eight; 256 empties the table. Throws InputError likewise.
[[nodiscard]] std::string unpack_compress(const std::filesystem::path& path, std::string_view packed,
                                          std::size_t largest);
/// The one file of a zip archive, stored or deflated (PKWARE's APPNOTE 6.3.10, 4.3). Throws InputError where
/// it holds none or several, where it is damaged or encrypted, and above `largest` bytes.
[[nodiscard]] std::string unpack_zip(const std::filesystem::path& path, std::string_view archive,
                                     std::size_t largest);

/// Throws InputError for the first bytes of what cannot be read here: other archives, and web pages, which
/// servers send instead of data where one must sign in.
void refuse_foreign_bytes(const std::filesystem::path& path, std::string_view head);

}  // namespace canyon
