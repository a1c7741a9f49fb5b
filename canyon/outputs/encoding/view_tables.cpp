#include "canyon/outputs/encoding/view_tables.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <new>

#include "canyon/base/arithmetic.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"

namespace canyon::encoding {
namespace {

// Written out, since GCC 10 has no `using enum`.
constexpr ViewType kF64 = ViewType::F64, kF32 = ViewType::F32, kI32 = ViewType::I32, kU32 = ViewType::U32,
                   kU16 = ViewType::U16, kU8 = ViewType::U8;

constexpr std::array kViewOfEpochs{
    ViewColumn{"time_s", kF64, "s", "since `time.begin`"},
    ViewColumn{"east_m", kF64, "m", "true antenna, east in the city's frame"},
    ViewColumn{"north_m", kF64, "m", "true antenna, north"},
    ViewColumn{"up_m", kF64, "m", "true antenna, up"},
    ViewColumn{"yaw_deg", kF64, "deg", "true direction of travel, from east counter-clockwise"},
    ViewColumn{"roll_deg", kF64, "deg", "left side up; 0 unless the trajectory has an attitude"},
    ViewColumn{"pitch_deg", kF64, "deg", "nose up; 0 unless the trajectory has an attitude"},
    ViewColumn{"status", kU8, "", "index into `words.status`; 1 is a fix"},
    ViewColumn{"fix_east_m", kF64, "m", "fix, east in the city's frame"},
    ViewColumn{"fix_north_m", kF64, "m", "fix, north"},
    ViewColumn{"fix_up_m", kF64, "m", "fix, up"},
    ViewColumn{"covariance_east_m2", kF64, "m^2", "variance east reported by the receiver"},
    ViewColumn{"covariance_north_m2", kF64, "m^2", "variance north"},
    ViewColumn{"covariance_up_m2", kF64, "m^2", "variance up"},
    ViewColumn{"skyline", kI32, "", "row of `skylines`; -1: none"},
};

constexpr std::array kSkylineColumns{
    ViewColumn{"elevation", kU8, "0.5 deg", "highest hidden elevation in each of skyline_sectors directions"},
};

constexpr std::array kViewOfSatellites{
    ViewColumn{"epoch", kU32, "", "index of the receiver's epoch"},
    ViewColumn{"satellite", kU16, "", "index into the header's satellites"},
    ViewColumn{"flags", kU8, "", "1 above the mask, 2 used in the fix, 4 measured, 8 excluded"},
    ViewColumn{"paths", kU16, "", "number of its rows of `paths`, which follow those of the previous row"},
};

constexpr std::array kViewOfPaths{
    ViewColumn{"kind", kU8, "", "index into `words.path`"},
};

constexpr std::array kMapCellColumns{
    ViewColumn{"state", kU8, "", "index into map.states; 0 has values"},
    ViewColumn{"up_m", kF32, "m", "of the cell's centre, city's frame; NaN without terrain"},
};

constexpr std::array kMapValueColumns{
    ViewColumn{"value", kF32, "",
               "layer by layer, all cells of each; in the layer's unit divided by its factor"},
};

constexpr std::array kComparisonColumns{
    ViewColumn{"recorded_rms_m", kF32, "m", "of the recorded pseudorange errors; NaN without one"},
    ViewColumn{"simulated_rms_m", kF32, "m", "of the simulated ones"},
    ViewColumn{"difference_rms_m", kF32, "m", "recorded minus simulated, of satellites measured in both"},
    ViewColumn{"both", kU16, "", "number of satellites"},
};

constexpr std::array kBodyColumns{
    ViewColumn{"epoch", kU32, "", "index of the receiver's epoch"},
    ViewColumn{"kind", kU8, "", "index into `words.body`"},
    ViewColumn{"east_m", kF32, "m",
               "of its centre, city's frame, rounded to 1/64 like all following columns"},
    ViewColumn{"north_m", kF32, "m", "of its centre"},
    ViewColumn{"low_m", kF32, "m", "up, of its lowest point"},
    ViewColumn{"high_m", kF32, "m", "up, of its highest point"},
    ViewColumn{"yaw_deg", kF32, "deg", "of its length, from east counter-clockwise"},
    ViewColumn{"length_m", kF32, "m", "diameter of a crown"},
    ViewColumn{"width_m", kF32, "m", "diameter of a crown"},
};

/// Viewer-only columns, followed by those of a table of all outputs.
std::vector<ViewColumn> with_columns_of(TableKind kind, std::span<const ViewColumn> own) {
  std::vector<ViewColumn> columns(own.begin(), own.end());
  for (const Column& c : table(kind).columns)
    if (c.view) columns.push_back({c.view_name, *c.view, c.unit, c.help, &c});
  return columns;
}

void put_little(std::string& out, std::uint64_t bits, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) out += static_cast<char>(bits >> 8 * i & 0xFFU);
}

void pad(std::string& out) {
  out.append((8 - out.size() % 8) % 8, '\0');
}

}  // namespace

std::string_view name(ViewType type) {
  static constexpr std::array<std::string_view, 6> kNames{"f64", "f32", "i32", "u32", "u16", "u8"};
  return kNames[static_cast<std::size_t>(type)];
}

std::size_t size_of(ViewType type) {
  static constexpr std::array<std::size_t, 6> kSizes{8, 4, 4, 4, 2, 1};
  return kSizes[static_cast<std::size_t>(type)];
}

std::span<const ViewTable> view_tables() {
  static const std::vector<ViewColumn> epochs = with_columns_of(TableKind::Epochs, kViewOfEpochs);
  static const std::vector<ViewColumn> satellites = with_columns_of(TableKind::Satellites, kViewOfSatellites);
  static const std::vector<ViewColumn> paths = with_columns_of(TableKind::Paths, kViewOfPaths);
  static const std::array all{ViewTable{"epochs", epochs},
                              ViewTable{"skylines", kSkylineColumns},
                              ViewTable{"satellites", satellites},
                              ViewTable{"paths", paths},
                              ViewTable{"map_cells", kMapCellColumns},
                              ViewTable{"map_values", kMapValueColumns},
                              ViewTable{"comparison", kComparisonColumns},
                              ViewTable{"bodies", kBodyColumns}};
  return all;
}

std::string markdown(const ViewTable& table) {
  std::vector<TextRow> rows;
  for (const ViewColumn& c : table.columns) {
    const bool indexed =
        c.from != nullptr && (c.from->kind == Column::Kind::Word || c.from->kind == Column::Kind::Text);
    rows.push_back({fmt::format("`{}`", c.name), std::string(name(c.type)), std::string(c.unit),
                    (indexed ? fmt::format("index into `words.{}`: ", c.name) : "") + std::string(c.about)});
  }
  return markdown_table({"column", "type", "unit", "meaning"}, rows);
}

std::size_t ViewWords::index(std::string_view column, const std::string& text) {
  std::vector<std::string>& list = lists_.find(column)->second;
  const auto at = std::find(list.begin(), list.end(), text);
  if (at == list.end()) list.push_back(text);
  return static_cast<std::size_t>(std::find(list.begin(), list.end(), text) - list.begin());
}

void ViewWords::clear() {
  for (const ViewTable& table : view_tables()) {
    for (const ViewColumn& c : table.columns)
      if (c.from != nullptr && c.from->kind == Column::Kind::Text) lists_[std::string(c.name)] = {""};
  }
}

ViewRows::ViewRows(ViewTableIndex table)
    : table_(table), about_(view_tables()[table].columns), columns_(about_.size()) {}

void ViewRows::put(std::size_t column, double value) {
  const ViewType type = about_[column].type;
  std::string& out = columns_[column];
  switch (type) {
    case ViewType::F64:
      return put_little(out, same_bytes<std::uint64_t>(value), 8);
    case ViewType::F32:
      return put_little(out, same_bytes<std::uint32_t>(static_cast<float>(value)), 4);
    case ViewType::I32:
    case ViewType::U32:
    case ViewType::U16:
    case ViewType::U8:
      // Integers have no NaN: an unknown value is 0.
      return put_little(
          out, static_cast<std::uint64_t>(std::isfinite(value) ? static_cast<std::int64_t>(value) : 0),
          size_of(type));
  }
}

void ViewRows::add(std::initializer_list<double> values) {
  assert(values.size() == columns_.size());
  std::size_t column = 0;
  for (const double value : values) put(column++, value);
  ++rows_;
}

void ViewRows::add(std::initializer_list<double> own, const Row& row, ViewWords& words) {
  std::size_t column = 0;
  for (const double value : own) put(column++, value);
  for (; column < columns_.size(); ++column) {
    assert(about_[column].from != nullptr);
    const Column& from = *about_[column].from;
    double value = from.kind == Column::Kind::Text
                       ? static_cast<double>(words.index(about_[column].name, from.text(row)))
                       : from.value(row);
    if (from.view_steps > 0) value = std::round(value * from.view_steps) / from.view_steps;
    put(column, value);
  }
  ++rows_;
}

void ViewRows::add_bytes(std::string_view bytes) {
  assert(columns_.size() == 1);
  columns_.front() += bytes;
  ++rows_;
}

void ViewRows::clear() {
  rows_ = 0;
  for (std::string& column : columns_) column.clear();
}

std::string encode_chunk(const std::vector<const ViewRows*>& tables) {
  std::string out = "canyonV1";
  put_little(out, tables.size(), 4);
  put_little(out, 0, 4);
  for (const ViewRows* rows : tables) {
    put_little(out, rows->table(), 4);
    put_little(out, rows->size(), 4);
  }
  for (const ViewRows* rows : tables) {
    for (const std::string& column : rows->columns_) {
      pad(out);
      out += column;
    }
  }
  pad(out);
  return out;
}

std::size_t write_chunk(const std::filesystem::path& folder, const std::string& name,
                        const std::vector<const ViewRows*>& tables) {
  const std::string bytes = encode_chunk(tables);
  write_file(folder / name, gzip(bytes));
  return bytes.size();
}

std::string gzip(std::string_view bytes) {
  z_stream stream{};
  // 15 window bits, plus 16 for gzip instead of zlib format.
  if (deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK) throw std::bad_alloc();
  std::string packed(deflateBound(&stream, static_cast<uLong>(bytes.size())), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  const int result = deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  if (result != Z_STREAM_END) throw std::bad_alloc();
  return packed;
}

}  // namespace canyon::encoding
