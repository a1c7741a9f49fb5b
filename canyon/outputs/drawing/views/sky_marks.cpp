#include "canyon/outputs/drawing/views/sky_marks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "canyon/base/geodesy/constants.hpp"

namespace canyon::drawing {
namespace {

using propagation::Visibility;

constexpr double kMarkSize = 6.5;

double overlap_of(const Rect& a, const Rect& b) {
  const double w = std::min(a.right(), b.right()) - std::max(a.x, b.x);
  const double h = std::min(a.bottom(), b.bottom()) - std::max(a.y, b.y);
  return w > 0 && h > 0 ? w * h : 0;
}

}  // namespace

void draw_sky_mask(Canvas& canvas, const SkyLens& lens, const SkyMask& mask) {
  std::vector<std::vector<Point>> rings;
  const double step = 2 * geodesy::kPi / static_cast<double>(std::max<std::size_t>(1, mask.azimuths.size()));
  for (std::size_t a = 0; a < mask.azimuths.size(); ++a) {
    // Slightly wider than the sector, to leave no seam to its neighbours.
    const double from = (static_cast<double>(a) - 0.02) * step;
    const double to = (static_cast<double>(a) + 1.02) * step;
    for (const SkyMask::Stretch& s : mask.azimuths[a]) {
      rings.push_back({lens.point(from, s.low_rad), lens.point(from, s.high_rad), lens.point(to, s.high_rad),
                       lens.point(to, s.low_rad)});
    }
  }
  canvas.polygons(rings, kSkySilhouette);
}

Point sky_rim_label(const SkyLens& lens, int azimuth_deg) {
  SkyLens wider = lens;
  wider.radius += azimuth_deg % 90 == 0 ? 17 : 15;
  return wider.point(geodesy::radians(azimuth_deg), 0);
}

void draw_sky_grid(Canvas& canvas, const SkyLens& lens, double elevation_mask_rad) {
  for (const int elevation_deg : {30, 60}) {
    canvas.circle(lens.centre, lens.radius * lens.reach(geodesy::radians(elevation_deg)), {},
                  Stroke{kInk.with_alpha(0.22), 0.8});
  }
  for (int azimuth_deg = 0; azimuth_deg < 360; azimuth_deg += 30) {
    const double azimuth = geodesy::radians(azimuth_deg);
    canvas.segments(
        {{lens.point(azimuth, azimuth_deg % 90 == 0 ? geodesy::radians(90) : geodesy::radians(60)),
          lens.point(azimuth, 0)}},
        {kInk.with_alpha(0.16), 0.8});
    static constexpr std::array kNames{"N", "E", "S", "W"};
    const bool cardinal = azimuth_deg % 90 == 0;
    canvas.text(
        sky_rim_label(lens, azimuth_deg),
        cardinal ? kNames[static_cast<std::size_t>(azimuth_deg / 90)] : fmt::format("{}\u00B0", azimuth_deg),
        {.size = cardinal ? 17.0 : 10.5,
         .colour = cardinal ? kInk : kFaintInk,
         .bold = cardinal,
         .align = Align::Centre,
         .level = TextLevel::Middle});
  }
  canvas.circle(lens.centre, lens.radius, {}, Stroke{kInk, 1.4});
  for (const int elevation_deg : {30, 60}) {
    canvas.text(lens.point(geodesy::radians(15), geodesy::radians(elevation_deg)),
                fmt::format("{}\u00B0", elevation_deg),
                {.size = 10.5,
                 .colour = kFaintInk,
                 .align = Align::Centre,
                 .level = TextLevel::Middle,
                 .halo = 2,
                 .halo_colour = kPaper.with_alpha(0.7)});
  }
  if (elevation_mask_rad > 0) {
    canvas.circle(lens.centre, lens.radius * lens.reach(elevation_mask_rad), {},
                  Stroke{kVermilion, 1.1, {5, 4}});
  }
}

void draw_satellite_mark(Canvas& canvas, const Point& at, Visibility visibility) {
  const Colour colour = colour_of(visibility);
  const Stroke rim{kPaper, 1.2};
  switch (visibility) {
    case Visibility::LOS:
      canvas.circle(at, kMarkSize, colour, rim);
      break;
    case Visibility::LOSMultipath:
      canvas.rectangle({at.x - 0.85 * kMarkSize, at.y - 0.85 * kMarkSize, 1.7 * kMarkSize, 1.7 * kMarkSize},
                       colour, rim);
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

void draw_reflection_mark(Canvas& canvas, const Point& at, Visibility visibility,
                          propagation::PathKind kind) {
  const Colour colour = colour_of(visibility);
  if (kind == propagation::PathKind::Diffuse) {
    canvas.circle(at, 3.2, colour.with_alpha(0.6), Stroke{kInk.with_alpha(0.5), 0.7});
    return;
  }
  const double s = 5.2, h = 4.2;
  const std::vector<Point> outline =
      kind == propagation::PathKind::Diffracted
          ? std::vector<Point>{{at.x - h, at.y - h},
                               {at.x + h, at.y - h},
                               {at.x + h, at.y + h},
                               {at.x - h, at.y + h}}
          : std::vector<Point>{{at.x, at.y - s}, {at.x + s, at.y}, {at.x, at.y + s}, {at.x - s, at.y}};
  canvas.polygons({outline}, kPaper, Stroke{kPaper, 3.4});
  canvas.polygons({outline}, colour, Stroke{kInk, 1});
}

void draw_trail(Canvas& canvas, const SkyLens& lens, const std::vector<SkyPoint>& trail, bool cased) {
  const auto position = [&lens](const SkyPoint& p) { return lens.point(p.azimuth_rad, p.elevation_rad); };
  if (cased) {
    std::vector<Point> route;
    for (const SkyPoint& p : trail) route.push_back(position(p));
    canvas.polyline(route, {kPaper.with_alpha(0.75), 4.6});
  }
  for (std::size_t begin = 0; begin + 1 < trail.size();) {
    std::vector<Point> piece{position(trail[begin])};
    std::size_t end = begin;
    do {
      ++end;
      piece.push_back(position(trail[end]));
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
  style.level = TextLevel::Middle;
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
    for (std::size_t i = 0; i < taken_.size(); ++i)
      if (i != own) overlap += overlap_of(box, taken_[i]);
    if (overlap < least) {
      least = overlap;
      best = box;
    }
  }
  taken_.push_back(best);
  canvas.text(best.centre(), text, style);
}

}  // namespace canyon::drawing
