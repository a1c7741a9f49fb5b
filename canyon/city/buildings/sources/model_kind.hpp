#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>

namespace canyon::buildings {

/// Reads up to `size` bytes of a file; returns 0 at its end.
using ByteReader = std::function<std::size_t(char* to, std::size_t size)>;
/// The first `maximum` bytes, or all if there are fewer.
[[nodiscard]] std::string first_bytes(const ByteReader& bytes, std::size_t maximum);

/// The kinds of city models, detected by content.
enum class ModelKind : std::uint8_t {
  None,      ///< not a city model, or missing
  CityGml,   ///< plain or gzip-compressed
  CityJson,  ///< likewise, also CityJSONSeq
  Archive,   ///< a zip archive with files named as city models
  Folder     ///< a folder with such files, or archives, at any depth
};

/// The kind by the first 64 KiB. A name that ends in .json, .jsonl (with .gz or without) counts as CityJSON,
/// unless the file begins as a file of Overpass.
[[nodiscard]] ModelKind model_kind(const std::filesystem::path& path);

/// CityGml or CityJson by the first bytes of a file, unpacked; else None.
[[nodiscard]] ModelKind model_kind_of_text(std::string_view head);

/// Whether the last part of a path ends with one of these lower-case endings, ignoring case.
[[nodiscard]] bool has_ending(const std::filesystem::path& path,
                              std::initializer_list<std::string_view> endings);

}  // namespace canyon::buildings
