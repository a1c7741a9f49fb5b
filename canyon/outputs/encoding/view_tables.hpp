#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/outputs/encoding/columns.hpp"

namespace canyon::encoding {

/// "f64", "f32", "i32", "u32", "u16", "u8": the type names in the viewer's header.
[[nodiscard]] std::string_view name(ViewType type);
/// Bytes of a value.
[[nodiscard]] std::size_t size_of(ViewType type);

struct ViewColumn {
  std::string_view name;
  ViewType type = ViewType::F64;
  std::string_view unit;         ///< "m", "deg"; empty if it has none
  std::string_view about;        ///< description, one line
  const Column* from = nullptr;  ///< source of its values; null: a viewer-only column
};

struct ViewTable {
  std::string_view name;
  /// Viewer-only columns first, then those of the table with that name in encoding::tables(), if it exists.
  std::span<const ViewColumn> columns;
};

/// The tables of "canyon view 1" in the order of the header; a chunk names them by that order.
/// docs/view-format.md has the same list.
[[nodiscard]] std::span<const ViewTable> view_tables();
enum ViewTableIndex : std::uint32_t {
  kViewEpochs,
  kViewSkylines,
  kViewSatellites,
  kViewPaths,
  kViewMapCells,
  kViewMapValues,
  kViewComparison,
  kViewBodies
};
/// Rows of a Markdown table: column, type, unit, meaning.
[[nodiscard]] std::string markdown(const ViewTable& table);

/// Texts of indices in columns, in order of first use; 0 is the empty text.
class ViewWords {
 public:
  [[nodiscard]] std::size_t index(std::string_view column, const std::string& text);
  /// The words of each column, also of columns with only the empty text.
  [[nodiscard]] const std::map<std::string, std::vector<std::string>, std::less<>>& lists() const {
    return lists_;
  }
  void clear();
  ViewWords() { clear(); }

 private:
  std::map<std::string, std::vector<std::string>, std::less<>> lists_;
};

/// Directions of a skyline, from north clockwise; one column of that many bytes per row.
inline constexpr int kSkylineSectors = 120;

/// Bits of the column "flags" of satellites.
enum SatelliteFlag : std::uint8_t { kAboveMask = 1, kUsed = 2, kMeasured = 4, kExcluded = 8 };

/// Rows of one of the viewer's tables, stored by columns.
class ViewRows {
 public:
  explicit ViewRows(ViewTableIndex table);

  [[nodiscard]] ViewTableIndex table() const { return table_; }
  [[nodiscard]] std::size_t size() const { return rows_; }
  [[nodiscard]] bool empty() const { return rows_ == 0; }
  /// A row: one value for each column, converted to its type. Precondition: as many as columns, in range.
  void add(std::initializer_list<double> values);
  /// A row of a table with columns of encoding::tables(): values of viewer-only columns, and the row for the
  /// others. Texts of indices are added to `words`.
  void add(std::initializer_list<double> own, const Row& row, ViewWords& words);
  /// A row of a table with one column of bytes; all rows have the same length.
  void add_bytes(std::string_view bytes);
  void clear();

 private:
  friend std::string encode_chunk(const std::vector<const ViewRows*>& tables);

  void put(std::size_t column, double value);

  ViewTableIndex table_;
  std::span<const ViewColumn> about_;
  std::size_t rows_ = 0;
  std::vector<std::string> columns_;
};

/// The bytes of a chunk (docs/view-format.md): "canyonV1", u32 number of tables, u32 reserved, of each u32
/// index in the header and u32 rows; then the columns of each table, each aligned to 8 bytes.
[[nodiscard]] std::string encode_chunk(const std::vector<const ViewRows*>& tables);

/// Writes a compressed chunk to a file of a folder; returns its uncompressed size in bytes. Throws InputError
/// if it cannot be written.
std::size_t write_chunk(const std::filesystem::path& folder, const std::string& file,
                        const std::vector<const ViewRows*>& tables);

/// Compresses as gzip (RFC 1952, read by browsers); deterministic bytes.
[[nodiscard]] std::string gzip(std::string_view bytes);

}  // namespace canyon::encoding
