#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace canyon::heatmap {

/// A corner in the coordinates of a tile's cells: cell (c, r) has its centre at (u, v) = (c, r).
struct RasterPoint {
  double u = 0, v = 0;
  double range = 0;  ///< from the plane along the direction to the corner [m]
};

/// Spans are extended by this much on either side [cells], so that rounding leaves no cell between triangles
/// with a common side: rounding moves an end by about 1e-12 for tiles near a city's centre.
constexpr double kSpanMargin = 1e-9;

/// Floor without a call into libm (SSE2 has no rounding); x in [-2, 2^30].
[[nodiscard]] inline int floor_of(double x) {
  return static_cast<int>(x + 2) - 2;
}
[[nodiscard]] inline int ceil_of(double x) {
  const int below = floor_of(x);
  return below + (below < x ? 1 : 0);
}

/// The two sides that bound the rows of a triangle's half: at row v, u = anchor + (v - base) slope.
struct RowBounds {
  double left_anchor = 0, left_base = 0, left_slope = 0;
  double right_anchor = 0, right_base = 0, right_slope = 0;
  double low = 0, high = 0;  ///< of u, in the tile
};
constexpr int kRowsAtOnce = 64;
/// First and last cells of `count` rows from `row` on (at most kRowsAtOnce); last below first: none.
void row_spans(const RowBounds& bounds, int row, int count, int* first, int* last);

/// Calls span(row, first, last) for the cells of a tile whose centres are in the closed triangle, row by row.
/// A common side gives the same ends for both triangles, since it is always followed from its lower to its
/// higher corner.
template <class Span>
void scan_triangle(RasterPoint a, RasterPoint b, RasterPoint c, std::size_t columns, std::size_t rows,
                   Span&& span) {
  if (b.v < a.v) std::swap(a, b);
  if (c.v < b.v) std::swap(b, c);
  if (b.v < a.v) std::swap(a, b);
  const double last_row = static_cast<double>(rows) - 1;
  if (!(a.v <= last_row && c.v >= 0)) return;
  const int begin = ceil_of(std::max(a.v, 0.0));
  const int end = floor_of(std::min(c.v, last_row));
  if (begin > end) return;
  const double low = -kSpanMargin, high = static_cast<double>(columns) - 1 + kSpanMargin;
  if (std::max(std::max(a.u, b.u), c.u) < low || std::min(std::min(a.u, b.u), c.u) > high) return;

  const double height = c.v - a.v;
  if (!(height > 0)) {  // flat, on a row
    const double left = std::max(std::min(std::min(a.u, b.u), c.u) - kSpanMargin, low);
    const double right = std::min(std::max(std::max(a.u, b.u), c.u) + kSpanMargin, high);
    const int first = ceil_of(left), last = floor_of(right);
    if (first <= last) span(begin, first, last);
    return;
  }
  const double long_slope = (c.u - a.u) / height;
  const bool bend_right = (b.u - a.u) * height > (c.u - a.u) * (b.v - a.v);
  // The short side from a to b bounds the rows below `bend`, the one from b to c those from there on.
  const int bend = b.v < c.v ? ceil_of(std::clamp(b.v, static_cast<double>(begin), end + 1.0)) : end + 1;
  for (int half = 0; half < 2; ++half) {
    const RasterPoint& from = half == 0 ? a : b;
    const RasterPoint& to = half == 0 ? b : c;
    const int half_begin = half == 0 ? begin : bend, half_end = half == 0 ? bend : end + 1;
    if (half_begin >= half_end) continue;
    const double rise = to.v - from.v;
    const double slope = rise > 0 ? (to.u - from.u) / rise : 0;
    const double anchor = rise > 0 ? from.u : to.u;
    const RowBounds bounds = bend_right ? RowBounds{a.u, a.v, long_slope, anchor, from.v, slope, low, high}
                                        : RowBounds{anchor, from.v, slope, a.u, a.v, long_slope, low, high};
    std::array<int, kRowsAtOnce> first, last;
    for (int row = half_begin; row < half_end; row += kRowsAtOnce) {
      const int count = std::min(half_end - row, kRowsAtOnce);
      row_spans(bounds, row, count, first.data(), last.data());
      for (int i = 0; i < count; ++i) {
        const auto k = static_cast<std::size_t>(i);
        if (first[k] <= last[k]) span(row + i, first[k], last[k]);
      }
    }
  }
}

/// One bit for each cell.
class BitRaster {
 public:
  /// Clears it for a size; its memory is reused.
  void reset(std::uint32_t columns, std::uint32_t rows) {
    columns_ = columns;
    rows_ = rows;
    stride_ = (columns + 63) / 64;
    bits_.assign(stride_ * rows, 0);
  }
  void add(const RasterPoint& a, const RasterPoint& b, const RasterPoint& c) {
    scan_triangle(a, b, c, columns_, rows_, [this](int row, int first, int last) { mark(row, first, last); });
  }
  /// Sets the bits [first, last] of a row.
  void mark(int row, int first, int last) {
    std::uint64_t* words = bits_.data() + static_cast<std::size_t>(row) * stride_;
    const int from = first >> 6, to = last >> 6;
    const std::uint64_t head = ~std::uint64_t{0} << (first & 63);
    const std::uint64_t tail = ~std::uint64_t{0} >> (63 - (last & 63));
    if (from == to) {
      words[from] |= head & tail;
      return;
    }
    words[from] |= head;
    for (int i = from + 1; i < to; ++i) words[i] = ~std::uint64_t{0};
    words[to] |= tail;
  }
  /// One byte for each cell, row by row: 1 if marked, else 0.
  void expand(std::span<std::uint8_t> bytes) const;

 private:
  std::uint32_t columns_ = 0, rows_ = 0;
  std::size_t stride_ = 0;
  std::vector<std::uint64_t> bits_;
};

/// The nearest range of each cell.
class RangeRaster {
 public:
  /// Ranges row by row, infinite at first.
  RangeRaster(std::span<float> ranges, std::uint32_t columns);
  void add(const RasterPoint& a, const RasterPoint& b, const RasterPoint& c);

 private:
  std::span<float> ranges_;
  std::size_t columns_;
};

}  // namespace canyon::heatmap
