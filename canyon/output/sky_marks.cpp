#include "canyon/output/sky_marks.hpp"

#include <algorithm>
#include <array>

namespace canyon::output {
namespace {

using propagation::Visibility;

constexpr double kMarkSize = 6.5;

double overlap_of(const Rect& a, const Rect& b) {
  const double w = std::min(a.right(), b.right()) - std::max(a.x, b.x);
  const double h = std::min(a.bottom(), b.bottom()) - std::max(a.y, b.y);
  return w > 0 && h > 0 ? w * h : 0;
}

}  // namespace

void draw_satellite_mark(Canvas& canvas, const Point& at, Visibility visibility) {
  const Colour colour = colour_of(visibility);
  const Stroke rim{kPaper, 1.2};
  switch (visibility) {
    case Visibility::LOS:
      canvas.circle(at, kMarkSize, colour, rim);
      break;
    case Visibility::LOSMultipath:
      canvas.circle(at, kMarkSize + 3, kPaper);
      canvas.circle(at, kMarkSize + 2.2, {}, Stroke{colour, 1.8});
      canvas.circle(at, kMarkSize - 1.8, colour);
      break;
    case Visibility::NLOS: {
      const double s = kMarkSize * 1.25;
      canvas.polygons(
          {{{at.x, at.y - s}, {at.x + 0.9 * s, at.y + 0.65 * s}, {at.x - 0.9 * s, at.y + 0.65 * s}}}, colour,
          Stroke{kInk, 1});
      break;
    }
    case Visibility::Blocked: {
      const double s = kMarkSize * 0.85;
      const std::vector<std::pair<Point, Point>> cross{{{at.x - s, at.y - s}, {at.x + s, at.y + s}},
                                                       {{at.x - s, at.y + s}, {at.x + s, at.y - s}}};
      canvas.segments(cross, {kPaper, 5});
      canvas.segments(cross, {kInk, 2.4});
      break;
    }
  }
}

void draw_reflection_mark(Canvas& canvas, const Point& at, Visibility visibility) {
  const double s = 5.2;
  canvas.polygons({{{at.x, at.y - s}, {at.x + s, at.y}, {at.x, at.y + s}, {at.x - s, at.y}}}, kPaper,
                  Stroke{kPaper, 3.4});
  canvas.polygons({{{at.x, at.y - s}, {at.x + s, at.y}, {at.x, at.y + s}, {at.x - s, at.y}}},
                  colour_of(visibility), Stroke{kInk, 1});
}

void draw_trail(Canvas& canvas, const SkyLens& lens, const std::vector<SkyPoint>& trail, bool cased) {
  const auto place = [&lens](const SkyPoint& p) { return lens.point(p.azimuth_rad, p.elevation_rad); };
  if (cased) {
    std::vector<Point> way;
    for (const SkyPoint& p : trail) way.push_back(place(p));
    canvas.polyline(way, {kPaper.with_alpha(0.75), 4.6});
  }
  for (std::size_t begin = 0; begin + 1 < trail.size();) {
    std::vector<Point> piece{place(trail[begin])};
    std::size_t end = begin;
    do {
      ++end;
      piece.push_back(place(trail[end]));
    } while (end + 1 < trail.size() && trail[end].visibility == trail[begin].visibility);
    const bool blocked = trail[begin].visibility == Visibility::Blocked;
    canvas.polyline(piece, {colour_of(trail[begin].visibility).with_alpha(0.8), blocked ? 1.4 : 2.6});
    begin = end;
  }
}

std::size_t SkyLabels::add_mark(const Point& at, double half_size) {
  taken_.push_back({at.x - half_size, at.y - half_size, 2 * half_size, 2 * half_size});
  return taken_.size() - 1;
}

void SkyLabels::draw(Canvas& canvas, const Point& at, std::size_t own, const std::string& text,
                     TextStyle style) {
  style.align = Align::Centre;
  style.level = Level::Middle;
  const double width = canvas.text_width(text, style);
  const double height = 1.12 * style.size;
  const double side = 0.5 * width + 13;
  const std::array<Point, 6> offsets{
      {{side, 0}, {-side, 0}, {0, -18}, {0, 18}, {0.8 * side, -15}, {-0.8 * side, 15}}};
  Rect best{};
  double least = 1e300;
  for (const Point& offset : offsets) {
    const Rect box{at.x + offset.x - 0.5 * width, at.y + offset.y - 0.5 * height, width, height};
    double overlap = 0;
    for (std::size_t i = 0; i < taken_.size(); ++i) {
      if (i != own) overlap += overlap_of(box, taken_[i]);
    }
    if (overlap < least) {
      least = overlap;
      best = box;
    }
  }
  taken_.push_back(best);
  canvas.text(best.centre(), text, style);
}

}  // namespace canyon::output
