#include "canyon/drawing/apng.hpp"

#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <csetjmp>
#include <cstring>
#include <functional>
#include <new>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "canyon/drawing/cairo_surface.hpp"

namespace canyon::drawing {
namespace {

struct Source {
  const std::string* bytes;
  std::size_t read = 0;
};

cairo_status_t take(void* from, unsigned char* bytes, unsigned length) {
  auto& source = *static_cast<Source*>(from);
  if (length > source.bytes->size() - source.read) return CAIRO_STATUS_READ_ERROR;
  std::memcpy(bytes, source.bytes->data() + source.read, length);
  source.read += length;
  return CAIRO_STATUS_SUCCESS;
}

constexpr std::string_view kSignature{"\x89PNG\r\n\x1a\n", 8};

std::string big_endian(std::uint32_t value) {
  return {static_cast<char>(value >> 24), static_cast<char>(value >> 16 & 0xFFU),
          static_cast<char>(value >> 8 & 0xFFU), static_cast<char>(value & 0xFFU)};
}

std::uint32_t number_at(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

/// Calls f(type, data) for each chunk.
void for_each_chunk(const std::string& png,
                    const std::function<void(std::string_view, std::string_view)>& f) {
  for (std::size_t at = kSignature.size(); at + 12 <= png.size();) {
    const std::size_t length = number_at(png, at);
    if (length > png.size() - at - 12) throw std::runtime_error("picture fails: a PNG's chunk is cut off");
    f(std::string_view(png).substr(at + 4, 4), std::string_view(png).substr(at + 8, length));
    at += 12 + length;
  }
}

struct Region {
  std::size_t x = 0, y = 0, width = 1, height = 1;
};

/// The smallest rectangle with all pixels that differ; one pixel where none does, since no frame may be
/// empty.
Region changed(const RgbImage& a, const RgbImage& b) {
  const auto width = static_cast<std::size_t>(a.width), height = static_cast<std::size_t>(a.height);
  std::size_t left = width, right = 0, top = height, bottom = 0;
  for (std::size_t y = 0; y < height; ++y) {
    const auto row = static_cast<std::ptrdiff_t>(y * width);
    const auto from = a.pixels.begin() + row, to = from + static_cast<std::ptrdiff_t>(width);
    const auto first = std::mismatch(from, to, b.pixels.begin() + row).first;
    if (first == to) continue;
    std::size_t last = width - 1;
    while (a.pixels[y * width + last] == b.pixels[y * width + last]) --last;
    left = std::min(left, static_cast<std::size_t>(first - from));
    right = std::max(right, last);
    top = std::min(top, y);
    bottom = y;
  }
  if (top == height) return {};
  return {left, top, right - left + 1, bottom - top + 1};
}

RgbImage cut(const RgbImage& image, const Region& region) {
  RgbImage part{static_cast<int>(region.width), static_cast<int>(region.height), {}};
  part.pixels.reserve(region.width * region.height);
  for (std::size_t y = region.y; y < region.y + region.height; ++y) {
    const auto from = image.pixels.begin() +
                      static_cast<std::ptrdiff_t>(y * static_cast<std::size_t>(image.width) + region.x);
    part.pixels.insert(part.pixels.end(), from, from + static_cast<std::ptrdiff_t>(region.width));
  }
  return part;
}

/// Writes a PNG of 8-bit RGB row by row, so that no copy of the pixels is needed. Calls of libpng come back
/// by longjmp() where they fail, so nothing that needs a destructor begins inside them.
class PngRows {
 public:
  PngRows(int width, int height)
      : png_(png_create_write_struct(PNG_LIBPNG_VER_STRING, this, failed, ignored)),
        info_(png_ != nullptr ? png_create_info_struct(png_) : nullptr) {
    if (info_ == nullptr) {
      png_destroy_write_struct(&png_, nullptr);
      throw std::bad_alloc();
    }
    guarded([&] {
      png_set_write_fn(png_, &bytes_, append, nullptr);
      png_set_IHDR(png_, info_, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 8,
                   PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                   PNG_FILTER_TYPE_DEFAULT);
      png_set_sRGB(png_, info_, PNG_sRGB_INTENT_PERCEPTUAL);
      png_write_info(png_, info_);
      // Charts get as small as with the filters, which take three quarters of the time. This call comes after
      // the header: before it, libpng would use its default, which is all filters.
      png_set_filter(png_, PNG_FILTER_TYPE_BASE, PNG_NO_FILTERS);
      png_set_compression_level(png_, 3);
      if constexpr (std::endian::native == std::endian::little) png_set_bgr(png_);
      png_set_filler(png_, 0,
                     std::endian::native == std::endian::little ? PNG_FILLER_AFTER : PNG_FILLER_BEFORE);
    });
  }
  ~PngRows() { png_destroy_write_struct(&png_, &info_); }
  PngRows(const PngRows&) = delete;
  PngRows& operator=(const PngRows&) = delete;

  /// @param pixels 0xRRGGBB, four bytes each; the fourth counts for nothing
  void add(const void* pixels) {
    guarded([&] { png_write_row(png_, static_cast<png_const_bytep>(pixels)); });
  }
  [[nodiscard]] std::string finish() {
    guarded([&] { png_write_end(png_, info_); });
    return std::move(bytes_);
  }

 private:
  template <typename Call>
  void guarded(const Call& call) {
    if (setjmp(png_jmpbuf(png_)) == 0) {
      call();
    } else {
      throw std::runtime_error("picture cannot be written: " + problem_);
    }
  }
  [[noreturn]] static void failed(png_structp png, png_const_charp problem) {
    static_cast<PngRows*>(png_get_error_ptr(png))->problem_ = problem;
    png_longjmp(png, 1);
  }
  static void ignored(png_structp, png_const_charp) {}
  static void append(png_structp png, png_bytep bytes, std::size_t count) {
    if (append_bytes(png_get_io_ptr(png), bytes, static_cast<unsigned>(count)) != CAIRO_STATUS_SUCCESS) {
      png_error(png, "no memory");
    }
  }

  png_structp png_;
  png_infop info_;
  std::string bytes_, problem_;
};

}  // namespace

RgbImage image_of(cairo_surface_t* surface) {
  RgbImage image{cairo_image_surface_get_width(surface), cairo_image_surface_get_height(surface), {}};
  const auto width = static_cast<std::size_t>(image.width), height = static_cast<std::size_t>(image.height);
  image.pixels.resize(width * height);
  for_each_row(surface, width, height, [&](const unsigned char* row, std::size_t first) {
    std::memcpy(image.pixels.data() + first, row, 4 * width);
  });
  for (std::uint32_t& pixel : image.pixels) pixel &= 0xFFFFFFU;
  return image;
}

RgbImage decode_png(const std::string& png) {
  Source source{&png};
  const Surface surface(cairo_image_surface_create_from_png_stream(take, &source));
  check(cairo_surface_status(surface.get()));
  const cairo_format_t format = cairo_image_surface_get_format(surface.get());
  if (format != CAIRO_FORMAT_RGB24 && format != CAIRO_FORMAT_ARGB32) {
    throw std::runtime_error("picture fails: a PNG that is not of 8-bit RGB");
  }
  return image_of(surface.get());
}

std::string encode_png(const RgbImage& image) {
  const auto width = static_cast<std::size_t>(image.width), height = static_cast<std::size_t>(image.height);
  assert(image.pixels.size() == width * height);
  PngRows rows(image.width, image.height);
  for (std::size_t y = 0; y < height; ++y) rows.add(image.pixels.data() + y * width);
  return rows.finish();
}

std::string encode_png(cairo_surface_t* surface) {
  const int width = cairo_image_surface_get_width(surface), height = cairo_image_surface_get_height(surface);
  PngRows rows(width, height);
  for_each_row(surface, static_cast<std::size_t>(width), static_cast<std::size_t>(height),
               [&](const unsigned char* row, std::size_t) { rows.add(row); });
  return rows.finish();
}

AnimatedPng::AnimatedPng(std::filesystem::path path, std::uint32_t frames, double frame_s)
    : file_(std::move(path)), frames_(frames) {
  assert(frames > 0);
  assert(frame_s >= 0.001 && frame_s <= 65);
  delay_ms_ = static_cast<std::uint16_t>(std::lround(1000 * frame_s));
}

void AnimatedPng::add(const std::string& png) {
  assert(added_ < frames_);
  RgbImage image = decode_png(png);
  assert(added_ == 0 || (image.width == last_.width && image.height == last_.height));
  Region region{0, 0, static_cast<std::size_t>(image.width), static_cast<std::size_t>(image.height)};
  std::string part;
  if (added_ == 0) {
    // The same encoder for all frames, since they share one header.
    part = encode_png(image);
    file_.write(kSignature);
    for_each_chunk(part, [&](std::string_view type, std::string_view data) {
      if (type == "IHDR") chunk("IHDR", std::string(data));
    });
    chunk("acTL", big_endian(frames_) + big_endian(0));
  } else {
    region = changed(last_, image);
    part = encode_png(cut(image, region));
  }
  control(static_cast<std::uint32_t>(region.width), static_cast<std::uint32_t>(region.height),
          static_cast<std::uint32_t>(region.x), static_cast<std::uint32_t>(region.y));
  for_each_chunk(part, [&](std::string_view type, std::string_view data) {
    if (type != "IDAT") return;
    if (added_ == 0) {
      chunk("IDAT", std::string(data));
    } else {
      chunk("fdAT", big_endian(sequence_++) + std::string(data));
    }
  });
  last_ = std::move(image);
  ++added_;
}

void AnimatedPng::commit() {
  assert(added_ == frames_);
  chunk("IEND", {});
  file_.commit();
}

void AnimatedPng::chunk(const char* type, const std::string& data) {
  const std::string body = type + data;
  const auto crc =
      crc32(0, reinterpret_cast<const unsigned char*>(body.data()), static_cast<uInt>(body.size()));
  file_.write(big_endian(static_cast<std::uint32_t>(data.size())) + body +
              big_endian(static_cast<std::uint32_t>(crc)));
}

void AnimatedPng::control(std::uint32_t width, std::uint32_t height, std::uint32_t x, std::uint32_t y) {
  constexpr std::uint32_t kThousandths = 1000;
  const std::string disposal_none_blend_source(2, '\0');
  chunk("fcTL", big_endian(sequence_++) + big_endian(width) + big_endian(height) + big_endian(x) +
                    big_endian(y) + big_endian(std::uint32_t{delay_ms_} << 16 | kThousandths) +
                    disposal_none_blend_source);
}

}  // namespace canyon::drawing
