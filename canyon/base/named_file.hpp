#pragma once

#include <filesystem>
#include <string_view>

namespace canyon {

/// Whether a file or folder, all links followed, lies in the folder of the file `by` or below: in that of its
/// name, or of what its name is a link to. @param other a folder as seen from by's, which takes its place
[[nodiscard]] bool lies_beside(const std::filesystem::path& path, const std::filesystem::path& by,
                               const std::filesystem::path& other = {});

/// The file that `by` names: an address without file://, from by's folder. Every reader asks it of what a
/// file says. Throws InputError unless the file lies_beside() `by`.
[[nodiscard]] std::filesystem::path file_named_by(const std::filesystem::path& by, std::string_view name);

}  // namespace canyon
