#pragma once

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/output/view_tables.hpp"

namespace canyon::output {

/// Rows of one of the viewer's tables, kept by columns.
class ViewRows {
 public:
  explicit ViewRows(ViewTableIndex table);

  [[nodiscard]] ViewTableIndex table() const { return table_; }
  [[nodiscard]] std::size_t size() const { return rows_; }
  [[nodiscard]] bool empty() const { return rows_ == 0; }
  /// A row: one value for each column, converted to its type. Precondition: as many as columns, in the range
  /// of their types.
  void add(std::initializer_list<double> values);
  /// A row of a table with columns of output::tables(): values of its own columns, and the row of the others.
  /// `words` takes the texts that indices stand for.
  void add(std::initializer_list<double> own, const Row& row, ViewWords& words);
  /// A row of a table of one column of bytes, as many as each row has.
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
/// index in the header and u32 rows; then, each begun at a multiple of 8 bytes, the columns of each table.
[[nodiscard]] std::string encode_chunk(const std::vector<const ViewRows*>& tables);

/// Writes a chunk to a folder's file, packed; returns its bytes unpacked. Throws InputError where the folder
/// does not take it.
std::size_t write_chunk(const std::filesystem::path& folder, const std::string& file,
                        const std::vector<const ViewRows*>& tables);

/// RFC 1952, as browsers unpack it; the same bytes every time.
[[nodiscard]] std::string gzip(std::string_view bytes);

}  // namespace canyon::output
