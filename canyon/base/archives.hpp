#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace canyon {

/// Whether a file that begins so is of gzip, of Unix compress (.Z), or a zip archive.
[[nodiscard]] bool is_gzip(std::string_view head);
[[nodiscard]] bool is_compress(std::string_view head);
[[nodiscard]] bool is_zip(std::string_view head);

/// Unpacks the LZW of compress 4.0: codes of 9 to 16 bits, the least significant bit first, in groups of
/// eight; 256 empties the table. Throws InputError, in the name of `path`, where the data are damaged, and
/// above `largest` bytes.
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
