#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace canyon::view {

/// viewer.html of the source tree that this program was built from; cmake/viewer.cmake defines it.
extern const char* const built_page;

/// The viewer as one HTML page, built from viewer/ (`./run view`): CANYON_VIEWER where the environment names
/// one, else viewer.html of the installed share/canyon, else that of the source tree. Throws InputError, with
/// the command that builds it, where there is none.
[[nodiscard]] std::filesystem::path find_page();

/// The files of the view in a folder, the city's first. Throws InputError where it has no view, or a file of
/// it is missing or cut off.
[[nodiscard]] std::vector<std::string> view_files(const std::filesystem::path& folder);

/// Fills a page in with the view of a folder: `target` opens from disk, without a server and without a
/// network. Returns its size in bytes. Throws InputError where view_files() does, or where the page is
/// none of Canyon's.
std::size_t export_page(const std::filesystem::path& page, const std::filesystem::path& folder,
                        const std::filesystem::path& target);

/// The bytes of a file. Throws InputError where it cannot be read.
[[nodiscard]] std::string read_bytes(const std::filesystem::path& path);

}  // namespace canyon::view
