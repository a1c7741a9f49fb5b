#pragma once

#include <cairo.h>

#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#include "canyon/drawing/canvas.hpp"

// Code that the files which call Cairo share. Private to canyon/drawing.

namespace canyon::drawing {

struct SurfaceDeleter {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
using Surface = std::unique_ptr<cairo_surface_t, SurfaceDeleter>;

inline void check(cairo_status_t status) {
  if (status != CAIRO_STATUS_SUCCESS) {
    throw std::runtime_error(std::string("picture cannot be drawn: ") + cairo_status_to_string(status));
  }
}

/// A cairo_write_func_t that appends to the std::string `target`. Called from C: nothing may be thrown
/// through it.
inline cairo_status_t append_bytes(void* target, const unsigned char* bytes, unsigned length) {
  try {
    static_cast<std::string*>(target)->append(reinterpret_cast<const char*>(bytes), length);
  } catch (const std::bad_alloc&) {
    return CAIRO_STATUS_NO_MEMORY;
  }
  return CAIRO_STATUS_SUCCESS;
}

/// Calls copy(row of the surface, its pixels' first index) for each of `rows` rows.
template <typename Copy>
void for_each_row(cairo_surface_t* surface, std::size_t columns, std::size_t rows, Copy copy) {
  unsigned char* bytes = cairo_image_surface_get_data(surface);
  const auto stride = static_cast<std::size_t>(cairo_image_surface_get_stride(surface));
  for (std::size_t row = 0; row < rows; ++row) copy(bytes + row * stride, row * columns);
}

/// An image of pixels 0xRRGGBB by rows from the top, columns * rows of them.
inline Surface make_surface(int columns, int rows, const std::vector<std::uint32_t>& pixels) {
  Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, columns, rows));
  check(cairo_surface_status(surface.get()));
  cairo_surface_flush(surface.get());
  const auto width = static_cast<std::size_t>(columns);
  for_each_row(
      surface.get(), width, static_cast<std::size_t>(rows),
      [&](unsigned char* row, std::size_t first) { std::memcpy(row, pixels.data() + first, 4 * width); });
  cairo_surface_mark_dirty(surface.get());
  return surface;
}

/// The pixels of an image of 8-bit RGB, which must have been flushed.
[[nodiscard]] RgbImage image_of(cairo_surface_t* surface);
/// The same as PNG, without a copy of them. Throws std::runtime_error where there is no memory.
[[nodiscard]] std::string encode_png(cairo_surface_t* surface);

}  // namespace canyon::drawing
