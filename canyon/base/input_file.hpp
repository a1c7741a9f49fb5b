#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

namespace canyon {

/// The largest file that a reader takes unless it says otherwise [bytes].
inline constexpr std::uint64_t kLargestFile = std::uint64_t{1} << 38;

/// Throws InputError unless `path` is a regular file (not a folder, and not a pipe or device, which may never
/// end) of at most `largest` bytes. Readers call it before they open a file.
void check_input_file(const std::filesystem::path& path, std::uint64_t largest = kLargestFile);

/// The first bytes of a file as it lies there; fewer where it is shorter, none where it cannot be read.
[[nodiscard]] std::string read_head(const std::filesystem::path& path, std::size_t bytes);

}  // namespace canyon
