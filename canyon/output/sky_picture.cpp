#include "canyon/output/sky_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/geodesy/constants.hpp"

namespace canyon::output {
namespace {

using propagation::Visibility;

constexpr std::array kVisibilities{Visibility::LOS, Visibility::LOSMultipath, Visibility::NLOS,
                                   Visibility::Blocked};
constexpr double kRadius = 340;
constexpr Point kCentre{410, 456};
constexpr double kWidth = 990;
constexpr double kHeight = 836;
constexpr Colour kSilhouette = rgb(0xC9CCD1);
constexpr double kMarkSize = 6.5;

Point sky_point(double azimuth_rad, double elevation_rad) {
  const double r = kRadius * (1 - elevation_rad / (0.5 * geodesy::kPi));
  return {kCentre.x + r * std::sin(azimuth_rad), kCentre.y - r * std::cos(azimuth_rad)};
}

void draw_mark(Canvas& canvas, const Point& at, Visibility visibility) {
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

void draw_mask(Canvas& canvas, const SkyMask& mask) {
  std::vector<std::vector<Point>> rings;
  const double step = 2 * geodesy::kPi / static_cast<double>(std::max<std::size_t>(1, mask.azimuths.size()));
  for (std::size_t a = 0; a < mask.azimuths.size(); ++a) {
    // A hair wider than the sector, so that neighbours leave no seam.
    const double from = (static_cast<double>(a) - 0.02) * step;
    const double to = (static_cast<double>(a) + 1.02) * step;
    for (const SkyMask::Stretch& s : mask.azimuths[a]) {
      rings.push_back({sky_point(from, s.low_rad), sky_point(from, s.high_rad), sky_point(to, s.high_rad),
                       sky_point(to, s.low_rad)});
    }
  }
  canvas.polygons(rings, kSilhouette);
}

void draw_grid(Canvas& canvas, double elevation_mask_rad) {
  for (const int elevation_deg : {30, 60}) {
    canvas.circle(kCentre, kRadius * (1 - elevation_deg / 90.0), {}, Stroke{kInk.with_alpha(0.22), 0.8});
  }
  for (int azimuth_deg = 0; azimuth_deg < 360; azimuth_deg += 30) {
    const double azimuth = geodesy::radians(azimuth_deg);
    canvas.segments({{sky_point(azimuth, azimuth_deg % 90 == 0 ? geodesy::radians(90) : geodesy::radians(60)),
                      sky_point(azimuth, 0)}},
                    {kInk.with_alpha(0.16), 0.8});
    const double r = kRadius + (azimuth_deg % 90 == 0 ? 17 : 15);
    static constexpr std::array kNames{"N", "E", "S", "W"};
    const bool cardinal = azimuth_deg % 90 == 0;
    canvas.text(
        {kCentre.x + r * std::sin(azimuth), kCentre.y - r * std::cos(azimuth)},
        cardinal ? kNames[static_cast<std::size_t>(azimuth_deg / 90)] : fmt::format("{}\u00B0", azimuth_deg),
        {.size = cardinal ? 17.0 : 10.5,
         .colour = cardinal ? kInk : kFaintInk,
         .bold = cardinal,
         .align = Align::Centre,
         .level = Level::Middle});
  }
  canvas.circle(kCentre, kRadius, {}, Stroke{kInk, 1.4});
  for (const int elevation_deg : {30, 60}) {
    canvas.text(sky_point(geodesy::radians(15), geodesy::radians(elevation_deg)),
                fmt::format("{}\u00B0", elevation_deg),
                {.size = 10.5,
                 .colour = kFaintInk,
                 .align = Align::Centre,
                 .level = Level::Middle,
                 .halo = 2,
                 .halo_colour = kPaper.with_alpha(0.7)});
  }
  if (elevation_mask_rad > 0) {
    canvas.circle(kCentre, kRadius * (1 - elevation_mask_rad / (0.5 * geodesy::kPi)), {},
                  Stroke{kVermilion, 1.1, {5, 4}});
  }
}

/// Pieces of one visibility each.
void draw_trail(Canvas& canvas, const std::vector<SkyPoint>& trail) {
  for (std::size_t begin = 0; begin + 1 < trail.size();) {
    std::vector<Point> piece{sky_point(trail[begin].azimuth_rad, trail[begin].elevation_rad)};
    std::size_t end = begin;
    do {
      ++end;
      piece.push_back(sky_point(trail[end].azimuth_rad, trail[end].elevation_rad));
    } while (end + 1 < trail.size() && trail[end].visibility == trail[begin].visibility);
    const bool blocked = trail[begin].visibility == Visibility::Blocked;
    canvas.polyline(piece, {colour_of(trail[begin].visibility).with_alpha(0.8), blocked ? 1.4 : 2.6});
    begin = end;
  }
}

/// Where a name stands clear of marks and of names placed before: right, left, above or below its mark.
class Labels {
 public:
  explicit Labels(const std::vector<SkySatellite>& satellites) {
    for (const SkySatellite& s : satellites) {
      const Point p = sky_point(s.now.azimuth_rad, s.now.elevation_rad);
      taken_.push_back({p.x - 8, p.y - 8, 16, 16});
    }
  }

  void draw(Canvas& canvas, const SkySatellite& satellite, std::size_t own) {
    const Point at = sky_point(satellite.now.azimuth_rad, satellite.now.elevation_rad);
    TextStyle style{.size = 12.5,
                    .bold = satellite.used,
                    .align = Align::Centre,
                    .level = Level::Middle,
                    .halo = 2.2,
                    .halo_colour = kPaper.with_alpha(0.85)};
    if (satellite.now.visibility == Visibility::Blocked) style.colour = kFaintInk;
    const double width = canvas.text_width(satellite.name, style);
    const double side = 0.5 * width + 13;
    const std::array<Point, 6> offsets{
        {{side, 0}, {-side, 0}, {0, -18}, {0, 18}, {0.8 * side, -15}, {-0.8 * side, 15}}};
    Rect best{};
    double least = 1e300;
    for (const Point& offset : offsets) {
      const Rect box{at.x + offset.x - 0.5 * width, at.y + offset.y - 7, width, 14};
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
    canvas.text(best.centre(), satellite.name, style);
  }

 private:
  static double overlap_of(const Rect& a, const Rect& b) {
    const double w = std::min(a.right(), b.right()) - std::max(a.x, b.x);
    const double h = std::min(a.bottom(), b.bottom()) - std::max(a.y, b.y);
    return w > 0 && h > 0 ? w * h : 0;
  }
  std::vector<Rect> taken_;
};

void draw_legend(Canvas& canvas, const SkyDrawing& drawing) {
  const double x = kCentre.x + kRadius + 62;
  double y = kCentre.y - kRadius + 10;
  canvas.text({x, y}, "Satellites", {.size = 13, .bold = true});
  y += 26;
  for (const Visibility visibility : kVisibilities) {
    const auto count = std::count_if(drawing.satellites.begin(), drawing.satellites.end(),
                                     [&](const SkySatellite& s) { return s.now.visibility == visibility; });
    draw_mark(canvas, {x + 10, y}, visibility);
    canvas.text({x + 30, y}, std::string(propagation::name(visibility)),
                {.size = 12, .level = Level::Middle});
    canvas.text({x + 172, y}, fmt::format("{}", count),
                {.size = 12, .align = Align::Right, .level = Level::Middle});
    y += 25;
  }
  const auto used = std::count_if(drawing.satellites.begin(), drawing.satellites.end(),
                                  [](const SkySatellite& s) { return s.used; });
  canvas.text({x, y}, "G05", {.size = 12, .bold = true, .level = Level::Middle});
  canvas.text({x + 36, y}, "used in the fix", {.size = 12, .level = Level::Middle});
  canvas.text({x + 172, y}, fmt::format("{}", used),
              {.size = 12, .align = Align::Right, .level = Level::Middle});
  y += 44;

  canvas.text({x, y}, "Sky", {.size = 13, .bold = true});
  y += 24;
  if (!drawing.mask.azimuths.empty()) {
    canvas.rectangle({x, y - 8, 20, 15}, kSilhouette, Stroke{kFaintInk, 0.6});
    canvas.text({x + 30, y}, fmt::format("hidden ({:.0f} %)", 100 * drawing.mask.hidden_share()),
                {.size = 12, .level = Level::Middle});
    y += 25;
  }
  if (drawing.elevation_mask_rad > 0) {
    canvas.polyline({{x, y}, {x + 20, y}}, {kVermilion, 1.3, {5, 4}});
    canvas.text(
        {x + 30, y},
        fmt::format("mask {:g}\u00B0", std::round(geodesy::degrees(drawing.elevation_mask_rad) * 10) / 10),
        {.size = 12, .level = Level::Middle});
    y += 25;
  }
  if (std::any_of(drawing.satellites.begin(), drawing.satellites.end(),
                  [](const SkySatellite& s) { return !s.trails.empty(); })) {
    canvas.polyline({{x, y}, {x + 20, y}}, {colour_of(Visibility::LOS), 2.6});
    canvas.text({x + 30, y}, "way over the run", {.size = 12, .level = Level::Middle});
  }
}

}  // namespace

Picture draw_sky(const SkyDrawing& drawing) {
  return render(kWidth, kHeight, [&drawing](Canvas& canvas) {
    draw_title(canvas, kCentre.x - kRadius - 30, drawing.title, drawing.subtitle);
    canvas.circle(kCentre, kRadius, kGround);
    draw_mask(canvas, drawing.mask);
    draw_grid(canvas, drawing.elevation_mask_rad);
    for (const SkySatellite& s : drawing.satellites) {
      for (const auto& trail : s.trails) draw_trail(canvas, trail);
    }
    for (const SkySatellite& s : drawing.satellites) {
      draw_mark(canvas, sky_point(s.now.azimuth_rad, s.now.elevation_rad), s.now.visibility);
    }
    Labels labels(drawing.satellites);
    for (std::size_t i = 0; i < drawing.satellites.size(); ++i) labels.draw(canvas, drawing.satellites[i], i);
    draw_legend(canvas, drawing);
  });
}

}  // namespace canyon::output
