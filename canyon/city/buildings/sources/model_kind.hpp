#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>

namespace canyon::buildings {

/// Gives up to `size` bytes of a file; 0 at its end.
using ByteReader = std::function<std::size_t(char* to, std::size_t size)>;
/// The first `most` bytes, or all.
[[nodiscard]] std::string first_bytes(const ByteReader& bytes, std::size_t most);

/// The kinds of city models, told by what is in them.
enum class ModelKind : std::uint8_t {
  None,      ///< not a city model, or not there
  CityGml,   ///< plain or packed by gzip
  CityJson,  ///< likewise, CityJSONSeq too
  Archive,   ///< a zip archive with files whose names end as city models' do
  Folder     ///< a folder with such files, or archives, somewhere in it
};

/// The kind by the first 64 KiB. A name that ends in .json, .jsonl (with .gz or without) counts as CityJSON,
/// unless the file begins as Overpass's.
[[nodiscard]] ModelKind model_kind(const std::filesystem::path& path);

/// CityGml or CityJson by the first bytes of a file, unpacked; else None.
[[nodiscard]] ModelKind model_kind_of_text(std::string_view head);

/// Whether the last part of a path ends as one of these, in small letters, in any case of letters.
[[nodiscard]] bool has_ending(const std::filesystem::path& path,
                              std::initializer_list<std::string_view> endings);

}  // namespace canyon::buildings
