#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

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
/// Unpacks such a file: the streams of bzip2, one or several, the LZW of compress, or the one file of a zip
/// archive. Throws InputError, in the name of `path`, where the data are damaged, for a zip archive that
/// holds none or several files or is encrypted, and for more than 1 GiB, or more than 256 MiB and 200 times
/// the packed size.
[[nodiscard]] std::string unpack(const std::filesystem::path& path, std::string_view packed);

/// Throws InputError for the first bytes of what cannot be read here: other archives, and web pages, which
/// servers send instead of data where one must sign in.
void refuse_foreign_bytes(const std::filesystem::path& path, std::string_view head);

/// Names of the files of a zip archive; none where it is damaged or not one.
[[nodiscard]] std::vector<std::string> zip_names(const std::filesystem::path& path);

}  // namespace canyon
