#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace canyon::view {

/// Type of a column's values in a chunk, little-endian.
enum class ColumnType : std::uint8_t { F64, F32, I32, U32, U16, U8 };
/// "f64", "f32", "i32", "u32", "u16", "u8": the words of the header.
[[nodiscard]] std::string_view name(ColumnType type);
/// Bytes of a value.
[[nodiscard]] std::size_t size_of(ColumnType type);

struct Column {
  std::string_view name;
  ColumnType type = ColumnType::F64;
  std::string_view unit;   ///< "m", "deg"; empty where there is none
  std::string_view about;  ///< one line for people
};

struct Table {
  std::string_view name;
  std::span<const Column> columns;
};

/// The tables of "canyon view 1" in the order of the header; a chunk names them by that order.
/// docs/view-format.md has the same list.
[[nodiscard]] std::span<const Table> tables();
enum TableIndex : std::uint32_t {
  kEpochs,
  kSkylines,
  kSatellites,
  kPaths,
  kMapCells,
  kMapValues,
  kComparison,
  kBodies
};

/// Directions of a skyline, from north clockwise; one column for all is as many bytes in a row.
inline constexpr int kSkylineSectors = 120;

/// Bits of the column "flags" of satellites.
enum SatelliteFlag : std::uint8_t { kAboveMask = 1, kUsed = 2, kMeasured = 4, kExcluded = 8 };

}  // namespace canyon::view
