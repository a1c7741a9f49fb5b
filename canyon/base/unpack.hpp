#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace canyon {

/// Unpacks a file that is_unpacked_whole(): the streams of bzip2, one or several, the LZW of compress, or the
/// single file of a zip archive. Throws InputError with `path` if the data are damaged, for a zip archive
/// that has no or several files or is encrypted, and for more than 1 GiB, or more than 256 MiB and 200 times
/// the packed size.
[[nodiscard]] std::string unpack(const std::filesystem::path& path, std::string_view packed);

/// Names of the files of a zip archive; none if it is damaged or not one.
[[nodiscard]] std::vector<std::string> zip_names(const std::filesystem::path& path);

}  // namespace canyon
