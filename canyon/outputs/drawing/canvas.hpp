#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "canyon/outputs/drawing/palette.hpp"

// Same declaration as in <cairo.h>, which users of this header need not have.
typedef struct _cairo cairo_t;  // NOLINT(bugprone-reserved-identifier)

namespace canyon::drawing {

/// A point of a picture: x to the right, y down, in the picture's units (1/96 inch).
struct Point {
  double x = 0;
  double y = 0;
};

struct Rect {
  double x = 0;
  double y = 0;
  double width = 0;
  double height = 0;

  [[nodiscard]] double right() const { return x + width; }
  [[nodiscard]] double bottom() const { return y + height; }
  [[nodiscard]] Point centre() const { return {x + 0.5 * width, y + 0.5 * height}; }
  [[nodiscard]] bool contains(const Point& p) const {
    return p.x >= x && p.x <= right() && p.y >= y && p.y <= bottom();
  }
};

struct Stroke {
  Colour colour = kInk;
  double width = 1;
  std::vector<double> dash = {};
};

enum class Align { Left, Centre, Right };
enum class TextLevel { Baseline, Top, Middle, Bottom };

struct TextStyle {
  double size = 12;
  Colour colour = kInk;
  bool bold = false;
  Align align = Align::Left;
  TextLevel level = TextLevel::Baseline;
  double angle_rad = 0;  ///< clockwise
  /// Width of a rim that keeps text readable on its background.
  double halo = 0;
  Colour halo_colour = kPaper;
};

/// A sheet to draw on, over Cairo. Text is UTF-8; invalid bytes are drawn as "?".
class Canvas {
 public:
  Canvas(cairo_t* cairo, double width, double height);
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  [[nodiscard]] double width() const { return width_; }
  [[nodiscard]] double height() const { return height_; }

  void rectangle(const Rect& r, const std::optional<Colour>& fill, const std::optional<Stroke>& stroke = {});
  /// Closed polygons filled as one shape (winding rule), so that no seam shows between neighbours.
  void polygons(const std::vector<std::vector<Point>>& rings, const std::optional<Colour>& fill,
                const std::optional<Stroke>& stroke = {});
  void polyline(const std::vector<Point>& points, const Stroke& stroke);
  void segments(const std::vector<std::pair<Point, Point>>& pieces, const Stroke& stroke);
  void circle(const Point& centre, double radius, const std::optional<Colour>& fill,
              const std::optional<Stroke>& stroke = {});
  void text(const Point& at, const std::string& text, const TextStyle& style = {});
  [[nodiscard]] double text_width(const std::string& text, const TextStyle& style = {});

  /// Draws pixels (0xRRGGBB, rows from the top, `columns` * `rows` of them) over `r`, unscaled if `r` has as
  /// many pixels of the picture.
  void image(const Rect& r, int columns, int rows, const std::vector<std::uint32_t>& pixels);

  /// Runs `draw` with everything outside `r` cut off.
  void clipped(const Rect& r, const std::function<void()>& draw);

 private:
  void paint(const std::optional<Colour>& fill, const std::optional<Stroke>& stroke);
  void select_font(const TextStyle& style);

  cairo_t* cairo_;
  double width_;
  double height_;
};

/// Pixels in rows from the top, each 0xRRGGBB.
struct RgbImage {
  int width = 0, height = 0;
  std::vector<std::uint32_t> pixels;
};

/// The bytes of a picture's SVG and PNG files.
struct Picture {
  std::string png;
  std::string svg;
};

/// Draws a picture of width x height units (rounded up) twice: as SVG, and as PNG with `png_scale` pixels to
/// the unit. Throws std::runtime_error if Cairo fails (memory).
[[nodiscard]] Picture render(double width, double height, const std::function<void(Canvas&)>& draw,
                             double png_scale = 2);

/// Draws a PNG of exactly width_px x height_px pixels, `scale` of them to the unit; bytes of the file. Throws
/// std::runtime_error if Cairo fails (memory).
[[nodiscard]] std::string render_png(int width_px, int height_px, double scale,
                                     const std::function<void(Canvas&)>& draw);
/// Draws the same picture and returns its pixels.
[[nodiscard]] RgbImage render_pixels(int width_px, int height_px, double scale,
                                     const std::function<void(Canvas&)>& draw);

/// Draws an SVG of width x height units; returns the file's bytes, which are deterministic. Throws
/// std::runtime_error if Cairo fails (memory).
[[nodiscard]] std::string render_svg(double width, double height, const std::function<void(Canvas&)>& draw);

/// Draws a title and a fainter line under it at the top left, in a smaller size if they do not fit. Returns
/// the y below them. @param halo TextStyle::halo of the title, for a background that is not plain
double draw_title(Canvas& canvas, double x, const std::string& title, const std::string& subtitle,
                  double halo = 0);

}  // namespace canyon::drawing
