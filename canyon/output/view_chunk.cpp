#include "canyon/output/view_chunk.hpp"

#include <zlib.h>

#include <cassert>
#include <cmath>
#include <new>

#include "canyon/base/arithmetic.hpp"
#include "canyon/base/output_file.hpp"

namespace canyon::output {
namespace {

void put_little(std::string& out, std::uint64_t bits, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) out += static_cast<char>(bits >> 8 * i & 0xFFU);
}

void pad(std::string& out) {
  out.append((8 - out.size() % 8) % 8, '\0');
}

}  // namespace

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
      // No integer stands for NaN: a value that is not known is 0.
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
  // 15 bits of window, and 16 for gzip's frame instead of zlib's.
  if (deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK) {
    throw std::bad_alloc();
  }
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

}  // namespace canyon::output
