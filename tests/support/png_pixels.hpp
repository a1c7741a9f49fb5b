#pragma once

#include <cairo.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>

#include "canyon/outputs/drawing/palette.hpp"

namespace canyon::test {

/// A decoded PNG; fails the test if it is not a PNG.
class PngPixels {
 public:
  explicit PngPixels(const std::string& png) {
    Source source{&png, 0};
    surface_ = cairo_image_surface_create_from_png_stream(read, &source);
    EXPECT_EQ(cairo_surface_status(surface_), CAIRO_STATUS_SUCCESS);
  }
  ~PngPixels() { cairo_surface_destroy(surface_); }
  PngPixels(const PngPixels&) = delete;
  PngPixels& operator=(const PngPixels&) = delete;

  [[nodiscard]] int width() const { return cairo_image_surface_get_width(surface_); }
  [[nodiscard]] int height() const { return cairo_image_surface_get_height(surface_); }

  /// 0xRRGGBB; above 0xFFFFFF outside the picture.
  [[nodiscard]] std::uint32_t pixel(int x, int y) const {
    if (x < 0 || y < 0 || x >= width() || y >= height()) return 0x01000000;
    std::uint32_t value = 0;
    std::memcpy(&value,
                cairo_image_surface_get_data(surface_) + y * cairo_image_surface_get_stride(surface_) + 4 * x,
                4);
    return value & 0xFFFFFFU;
  }
  [[nodiscard]] std::size_t count(const drawing::Colour& colour) const {
    std::size_t n = 0;
    for (int y = 0; y < height(); ++y) {
      for (int x = 0; x < width(); ++x) n += is(pixel(x, y), colour) ? 1U : 0U;
    }
    return n;
  }
  /// Compares within `tolerance` of 255 in each channel.
  static bool is(std::uint32_t pixel, const drawing::Colour& c, double tolerance = 2) {
    const auto near = [tolerance](std::uint32_t byte, double wanted) {
      return std::abs(static_cast<double>(byte) - 255 * wanted) <= tolerance;
    };
    return pixel <= 0xFFFFFFU && near(pixel >> 16 & 0xFFU, c.r) && near(pixel >> 8 & 0xFFU, c.g) &&
           near(pixel & 0xFFU, c.b);
  }

 private:
  struct Source {
    const std::string* bytes;
    std::size_t read;
  };
  static cairo_status_t read(void* from, unsigned char* data, unsigned length) {
    auto& source = *static_cast<Source*>(from);
    if (source.read + length > source.bytes->size()) return CAIRO_STATUS_READ_ERROR;
    std::memcpy(data, source.bytes->data() + source.read, length);
    source.read += length;
    return CAIRO_STATUS_SUCCESS;
  }

  cairo_surface_t* surface_ = nullptr;
};

}  // namespace canyon::test
