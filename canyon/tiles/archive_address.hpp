#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "canyon/base/text.hpp"

// Addresses of files in archives of a tileset (.3tz): `/vsizip/{archive}/file`, as GDAL opens them.

namespace canyon::tiles {

inline constexpr std::string_view kInArchive = "/vsizip/{";

/// Whether a path names an archive of a tileset: ends in .3tz.
[[nodiscard]] inline bool is_archive(const std::filesystem::path& path) {
  return lower_case(path.extension().string()) == ".3tz";
}

/// Whether an address is that of a file in an archive.
[[nodiscard]] inline bool is_in_archive(std::string_view address) {
  return address.substr(0, kInArchive.size()) == kInArchive;
}

/// The address of a file in an archive. @param archive a whole path
[[nodiscard]] inline std::string in_archive(const std::string& archive, std::string_view file) {
  return std::string(kInArchive).append(archive).append("}/").append(file);
}

}  // namespace canyon::tiles
