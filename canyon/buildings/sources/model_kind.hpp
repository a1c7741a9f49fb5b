#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace canyon::buildings {

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

}  // namespace canyon::buildings
