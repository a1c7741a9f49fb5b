#include "canyon/analysis/heatmap/kernels/shadow_raster.hpp"

#include <cassert>
#include <cstring>
#include <limits>

#include "canyon/base/arithmetic.hpp"

namespace canyon::heatmap {
namespace {

/// The bits of a byte as eight bytes of 0 or 1, lowest first.
using ByteOfBits = std::array<std::array<std::uint8_t, 8>, 256>;
constexpr ByteOfBits make_bytes() {
  ByteOfBits table{};
  for (std::size_t value = 0; value < 256; ++value)
    for (std::size_t bit = 0; bit < 8; ++bit)
      table[value][bit] = static_cast<std::uint8_t>((value >> bit) & 1);
  return table;
}
constexpr ByteOfBits kBytes = make_bytes();

}  // namespace

// Computes the ends of spans in doubles and rounds them, four rows at a time. The first cell is the least one
// not below u: the integer part of u + 1, except if u is exactly an integer; the margin covers that.
CANYON_CLONES
void row_spans(const RowBounds& bounds, int row, int count, int* first, int* last) {
  const RowBounds b = bounds;
  const double below = b.low - 1, beyond = b.high + 1;
  for (int i = 0; i < count; ++i) {
    const double v = row + i;
    double left = b.left_anchor + (v - b.left_base) * b.left_slope - kSpanMargin;
    double right = b.right_anchor + (v - b.right_base) * b.right_slope + kSpanMargin;
    left = left > b.low ? left : b.low;
    left = left < beyond ? left : beyond;
    right = right < b.high ? right : b.high;
    right = right > below ? right : below;
    first[i] = static_cast<int>(left + 3) - 2;
    last[i] = static_cast<int>(right + 2) - 2;
  }
}

void BitRaster::expand(std::span<std::uint8_t> bytes) const {
  assert(bytes.size() == std::size_t{columns_} * rows_);
  for (std::size_t row = 0; row < rows_; ++row) {
    const std::uint64_t* words = bits_.data() + row * stride_;
    std::uint8_t* out = bytes.data() + row * columns_;
    std::size_t column = 0;
    for (; column + 8 <= columns_; column += 8)
      std::memcpy(out + column, kBytes[(words[column >> 6] >> (column & 63)) & 255].data(), 8);
    for (; column < columns_; ++column)
      out[column] = static_cast<std::uint8_t>((words[column >> 6] >> (column & 63)) & 1);
  }
}

RangeRaster::RangeRaster(std::span<float> ranges, std::uint32_t columns)
    : ranges_(ranges), columns_(columns) {
  std::fill(ranges_.begin(), ranges_.end(), std::numeric_limits<float>::infinity());
}

void RangeRaster::add(const RasterPoint& a, const RasterPoint& b, const RasterPoint& c) {
  // range(u, v) = a.range + along_u (u - a.u) + along_v (v - a.v), the plane through the three corners.
  const double bu = b.u - a.u, bv = b.v - a.v, cu = c.u - a.u, cv = c.v - a.v;
  const double bt = b.range - a.range, ct = c.range - a.range;
  const double twice_area = bu * cv - cu * bv;
  if (twice_area == 0) return;  // seen edge-on: a ray in its plane hits its neighbours
  const double along_u = (bt * cv - ct * bv) / twice_area;
  const double along_v = (ct * bu - bt * cu) / twice_area;
  // If a triangle is seen nearly edge-on, the slopes are inaccurate, but its corners are exact.
  const double least = std::min(std::min(a.range, b.range), c.range);
  const double maximum = std::max(std::max(a.range, b.range), c.range);
  scan_triangle(a, b, c, columns_, ranges_.size() / columns_, [&](int row, int first, int last) {
    float* cells = ranges_.data() + static_cast<std::size_t>(row) * columns_ + first;
    const double start = a.range + along_u * (first - a.u) + along_v * (row - a.v);
    const int count = last - first + 1;
    for (int i = 0; i < count; ++i) {
      double range = start + along_u * i;
      range = range > least ? range : least;
      range = range < maximum ? range : maximum;
      const float rounded = static_cast<float>(range);
      cells[i] = rounded < cells[i] ? rounded : cells[i];
    }
  });
}

}  // namespace canyon::heatmap
