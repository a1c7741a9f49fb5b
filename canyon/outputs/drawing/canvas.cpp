#include "canyon/outputs/drawing/canvas.hpp"

#include <cairo-svg.h>
#include <cairo.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <new>
#include <stdexcept>
#include <string_view>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/text.hpp"

namespace canyon::drawing {
namespace {

struct ContextDeleter {
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};
using Context = std::unique_ptr<cairo_t, ContextDeleter>;

struct SurfaceDeleter {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
using Surface = std::unique_ptr<cairo_surface_t, SurfaceDeleter>;

void check(cairo_status_t status) {
  if (status != CAIRO_STATUS_SUCCESS)
    throw std::runtime_error(std::string("picture cannot be drawn: ") + cairo_status_to_string(status));
}

/// A cairo_write_func_t that appends to the std::string `target`. Called from C, so it must not throw.
cairo_status_t append_bytes(void* target, const unsigned char* bytes, unsigned length) {
  try {
    static_cast<std::string*>(target)->append(reinterpret_cast<const char*>(bytes), length);
  } catch (const std::bad_alloc&) {
    return CAIRO_STATUS_NO_MEMORY;
  }
  return CAIRO_STATUS_SUCCESS;
}

/// Calls copy(row of the surface, the index of the row's first pixel) for each row.
template <typename Copy>
void for_each_row(cairo_surface_t* surface, Copy copy) {
  unsigned char* bytes = cairo_image_surface_get_data(surface);
  const auto stride = static_cast<std::size_t>(cairo_image_surface_get_stride(surface));
  const auto columns = static_cast<std::size_t>(cairo_image_surface_get_width(surface));
  const auto rows = static_cast<std::size_t>(cairo_image_surface_get_height(surface));
  for (std::size_t row = 0; row < rows; ++row) copy(bytes + row * stride, row * columns);
}

/// An image of pixels 0xRRGGBB in rows from the top, columns * rows of them.
Surface make_surface(int columns, int rows, const std::vector<std::uint32_t>& pixels) {
  Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, columns, rows));
  check(cairo_surface_status(surface.get()));
  cairo_surface_flush(surface.get());
  for_each_row(surface.get(), [&](unsigned char* row, std::size_t first) {
    std::memcpy(row, pixels.data() + first, 4 * static_cast<std::size_t>(columns));
  });
  cairo_surface_mark_dirty(surface.get());
  return surface;
}

void draw_on(cairo_surface_t* surface, double scale, double width, double height,
             const std::function<void(Canvas&)>& draw) {
  check(cairo_surface_status(surface));
  const Context context(cairo_create(surface));
  check(cairo_status(context.get()));
  cairo_scale(context.get(), scale, scale);
  Canvas canvas(context.get(), width, height);
  canvas.rectangle({0, 0, width, height}, kPaper);
  draw(canvas);
  check(cairo_status(context.get()));
}

/// Paper of this size [px] with the drawing of `draw`.
Surface rendered(int width_px, int height_px, double scale, const std::function<void(Canvas&)>& draw) {
  Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width_px, height_px));
  draw_on(surface.get(), scale, width_px / scale, height_px / scale, draw);
  cairo_surface_flush(surface.get());
  return surface;
}

/// Cairo names groups "surfaceN" by a process-wide counter; here they are numbered per picture, so that equal
/// pictures have equal bytes.
std::string with_unique_numbers(const std::string& svg) {
  static constexpr std::string_view kStem = "surface";
  std::map<std::string, std::size_t> numbers;
  std::string result;
  result.reserve(svg.size());
  std::size_t copied = 0;
  for (std::size_t at = svg.find(kStem); at != std::string::npos; at = svg.find(kStem, at)) {
    at += kStem.size();
    const std::size_t end = std::min(svg.find_first_not_of("0123456789", at), svg.size());
    if (end == at) continue;
    const auto number = numbers.emplace(svg.substr(at, end - at), numbers.size() + 1).first->second;
    result.append(svg, copied, at - copied).append(std::to_string(number));
    copied = at = end;
  }
  return result.append(svg, copied, std::string::npos);
}

}  // namespace

Canvas::Canvas(cairo_t* cairo, double width, double height) : cairo_(cairo), width_(width), height_(height) {
  cairo_set_line_join(cairo_, CAIRO_LINE_JOIN_ROUND);
}

void Canvas::paint(const std::optional<Colour>& fill, const std::optional<Stroke>& stroke) {
  if (fill) {
    cairo_set_source_rgba(cairo_, fill->r, fill->g, fill->b, fill->a);
    if (stroke)
      cairo_fill_preserve(cairo_);
    else
      cairo_fill(cairo_);
  }
  if (stroke) {
    cairo_set_source_rgba(cairo_, stroke->colour.r, stroke->colour.g, stroke->colour.b, stroke->colour.a);
    cairo_set_line_width(cairo_, stroke->width);
    cairo_set_dash(cairo_, stroke->dash.data(), static_cast<int>(stroke->dash.size()), 0);
    cairo_stroke(cairo_);
  }
  cairo_new_path(cairo_);
}

void Canvas::rectangle(const Rect& r, const std::optional<Colour>& fill,
                       const std::optional<Stroke>& stroke) {
  cairo_rectangle(cairo_, r.x, r.y, r.width, r.height);
  paint(fill, stroke);
}

void Canvas::polygons(const std::vector<std::vector<Point>>& rings, const std::optional<Colour>& fill,
                      const std::optional<Stroke>& stroke) {
  for (const auto& ring : rings) {
    if (ring.empty()) continue;
    cairo_move_to(cairo_, ring.front().x, ring.front().y);
    for (std::size_t i = 1; i < ring.size(); ++i) cairo_line_to(cairo_, ring[i].x, ring[i].y);
    cairo_close_path(cairo_);
  }
  paint(fill, stroke);
}

void Canvas::polyline(const std::vector<Point>& points, const Stroke& stroke) {
  if (points.size() < 2) return;
  cairo_move_to(cairo_, points.front().x, points.front().y);
  for (std::size_t i = 1; i < points.size(); ++i) cairo_line_to(cairo_, points[i].x, points[i].y);
  paint({}, stroke);
}

void Canvas::segments(const std::vector<std::pair<Point, Point>>& pieces, const Stroke& stroke) {
  for (const auto& [from, to] : pieces) {
    cairo_move_to(cairo_, from.x, from.y);
    cairo_line_to(cairo_, to.x, to.y);
  }
  paint({}, stroke);
}

void Canvas::circle(const Point& centre, double radius, const std::optional<Colour>& fill,
                    const std::optional<Stroke>& stroke) {
  cairo_new_sub_path(cairo_);
  cairo_arc(cairo_, centre.x, centre.y, radius, 0, 2 * geodesy::kPi);
  cairo_close_path(cairo_);
  paint(fill, stroke);
}

void Canvas::select_font(const TextStyle& style) {
  cairo_select_font_face(cairo_, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         style.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(cairo_, style.size);
}

double Canvas::text_width(const std::string& text, const TextStyle& style) {
  select_font(style);
  cairo_text_extents_t extents;
  cairo_text_extents(cairo_, valid_utf8(text).c_str(), &extents);
  return extents.x_advance;
}

void Canvas::text(const Point& at, const std::string& text, const TextStyle& style) {
  const std::string valid = valid_utf8(text);
  select_font(style);
  cairo_text_extents_t extents;
  cairo_text_extents(cairo_, valid.c_str(), &extents);
  double dx = 0;
  if (style.align == Align::Centre) dx = -0.5 * extents.x_advance;
  if (style.align == Align::Right) dx = -extents.x_advance;
  // Aligns by the height of capitals, not of this text's letters, so that neighbours have the same base line.
  const double capital = 0.73 * style.size;
  double dy = 0;
  if (style.level == TextLevel::Top) dy = capital;
  if (style.level == TextLevel::Middle) dy = 0.5 * capital;
  if (style.level == TextLevel::Bottom) dy = -0.21 * style.size;
  cairo_save(cairo_);
  cairo_translate(cairo_, at.x, at.y);
  cairo_rotate(cairo_, style.angle_rad);
  if (style.halo > 0) {
    cairo_move_to(cairo_, dx, dy);
    cairo_text_path(cairo_, valid.c_str());
    paint({}, Stroke{style.halo_colour, 2 * style.halo});
  }
  cairo_set_source_rgba(cairo_, style.colour.r, style.colour.g, style.colour.b, style.colour.a);
  cairo_move_to(cairo_, dx, dy);
  cairo_show_text(cairo_, valid.c_str());
  cairo_new_path(cairo_);
  cairo_restore(cairo_);
}

void Canvas::image(const Rect& r, int columns, int rows, const std::vector<std::uint32_t>& pixels) {
  const Surface surface = make_surface(columns, rows, pixels);
  cairo_save(cairo_);
  cairo_translate(cairo_, r.x, r.y);
  cairo_scale(cairo_, r.width / columns, r.height / rows);
  cairo_set_source_surface(cairo_, surface.get(), 0, 0);
  cairo_paint(cairo_);
  cairo_restore(cairo_);
}

void Canvas::clipped(const Rect& r, const std::function<void()>& draw) {
  cairo_save(cairo_);
  cairo_rectangle(cairo_, r.x, r.y, r.width, r.height);
  cairo_clip(cairo_);
  draw();
  cairo_restore(cairo_);
}

std::string render_png(int width_px, int height_px, double scale, const std::function<void(Canvas&)>& draw) {
  const Surface surface = rendered(width_px, height_px, scale, draw);
  // Converts pixels in place to packed red, green, blue bytes.
  unsigned char* const rgb = cairo_image_surface_get_data(surface.get());
  unsigned char* end = rgb;
  for_each_row(surface.get(), [&](const unsigned char* row, std::size_t) {
    for (std::size_t column = 0; column < static_cast<std::size_t>(width_px); ++column) {
      std::uint32_t pixel = 0;
      std::memcpy(&pixel, row + 4 * column, sizeof pixel);
      *end++ = static_cast<unsigned char>(pixel >> 16);
      *end++ = static_cast<unsigned char>(pixel >> 8);
      *end++ = static_cast<unsigned char>(pixel);
    }
  });
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width_px);
  image.height = static_cast<png_uint_32>(height_px);
  image.format = PNG_FORMAT_RGB;
  image.flags = PNG_IMAGE_FLAG_FAST;  // no filters: same size for charts, in less time
  char* bytes = nullptr;
  std::size_t size = 0;
  std::FILE* const memory = open_memstream(&bytes, &size);
  if (memory == nullptr) throw std::bad_alloc();
  const bool written = png_image_write_to_stdio(&image, memory, 0, rgb, 0, nullptr) != 0;
  std::fclose(memory);
  std::string png(bytes, size);
  std::free(bytes);
  if (!written) throw std::runtime_error(std::string("picture cannot be written: ") + image.message);
  return png;
}

RgbImage render_pixels(int width_px, int height_px, double scale, const std::function<void(Canvas&)>& draw) {
  const Surface surface = rendered(width_px, height_px, scale, draw);
  const auto width = static_cast<std::size_t>(width_px);
  RgbImage image{width_px, height_px,
                 std::vector<std::uint32_t>(width * static_cast<std::size_t>(height_px))};
  for_each_row(surface.get(), [&](const unsigned char* row, std::size_t first) {
    std::memcpy(image.pixels.data() + first, row, 4 * width);
  });
  for (std::uint32_t& pixel : image.pixels) pixel &= 0xFFFFFFU;
  return image;
}

std::string render_svg(double width, double height, const std::function<void(Canvas&)>& draw) {
  std::string svg;
  const Surface surface(cairo_svg_surface_create_for_stream(append_bytes, &svg, width, height));
  draw_on(surface.get(), 1, width, height, draw);
  cairo_surface_finish(surface.get());
  check(cairo_surface_status(surface.get()));
  return with_unique_numbers(svg);
}

Picture render(double width, double height, const std::function<void(Canvas&)>& draw, double png_scale) {
  // Whole units: a partly covered row of pixels would show as a line.
  width = std::ceil(width);
  height = std::ceil(height);
  return {render_png(static_cast<int>(std::lround(width * png_scale)),
                     static_cast<int>(std::lround(height * png_scale)), png_scale, draw),
          render_svg(width, height, draw)};
}

double draw_title(Canvas& canvas, double x, const std::string& title, const std::string& subtitle,
                  double halo) {
  const auto fitting = [&](const std::string& text, TextStyle style) {
    const double room = canvas.width() - x - 16;
    const double width = canvas.text_width(text, style);
    if (width > room) style.size *= room / width;
    return style;
  };
  canvas.text({x, 36}, title, fitting(title, {.size = 20, .bold = true, .halo = halo}));
  canvas.text({x, 58}, subtitle,
              fitting(subtitle, {.size = 12.5, .colour = kFaintInk, .halo = halo * 5 / 6}));
  return 74;
}

}  // namespace canyon::drawing
