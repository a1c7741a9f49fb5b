#pragma once

#include <filesystem>
#include <string_view>

namespace canyon {

/// A kind of file that Canyon does not read.
struct ForeignFile {
  std::string_view name;  ///< "a log of PX4 (ULog)"
  std::string_view use;   ///< what its owner can do instead
};

/// The kind of a file of another program by its first bytes; null for all others.
/// @param head unpacked: 16 KiB suffice
[[nodiscard]] const ForeignFile* foreign_file(std::string_view head);
/// The same by the ending of its name, ".sigmf-data", for files whose bytes have no mark.
[[nodiscard]] const ForeignFile* foreign_ending(std::string_view ending);

/// Throws InputError for the first bytes of what cannot be read here: other archives, and web pages, which
/// servers send instead of data where one must sign in.
void refuse_foreign_bytes(const std::filesystem::path& path, std::string_view head);

}  // namespace canyon
