#include "canyon/outputs/drawing/views/sky_picture.hpp"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/city/city.hpp"
#include "canyon/outputs/drawing/views/sky_marks.hpp"

namespace canyon::drawing {
namespace {

using propagation::PathKind;
using propagation::Visibility;

constexpr std::array kVisibilities{Visibility::LOS, Visibility::LOSMultipath, Visibility::NLOS,
                                   Visibility::Blocked};
constexpr double kRadius = 340;  // of the horizon
constexpr Point kCentre{410, 456};
constexpr double kSkyWidth = 990;
constexpr double kSkyHeight = 836;

/// Notes on the picture how it differs from a map.
void draw_fisheye_notes(Canvas& canvas, const Point& at) {
  canvas.text(at, fmt::format("lines on walls: every {:g} m", kWallLines_m),
              {.size = 12, .level = TextLevel::Middle});
  canvas.text({at.x, at.y + 18}, "of height above the antenna",
              {.size = 10.5, .colour = kFaintInk, .level = TextLevel::Middle});
  canvas.text({at.x, at.y + 56}, "Looking up", {.size = 13, .bold = true});
  canvas.text({at.x, at.y + 78}, "north up: east is LEFT,", {.size = 12, .level = TextLevel::Middle});
  canvas.text({at.x, at.y + 96}, "west is RIGHT", {.size = 12, .level = TextLevel::Middle});
}

/// Writes the reason for no reception across the disc.
void draw_containment(Canvas& canvas, raytrace::Containment containment) {
  if (containment == raytrace::Containment::Free) return;
  const std::string text = fmt::format(
      "antenna {}: no signal",
      containment == raytrace::Containment::InsideBuilding ? "inside a building" : "under the terrain");
  const TextStyle style{
      .size = 15, .colour = kVermilion, .bold = true, .align = Align::Centre, .level = TextLevel::Middle};
  const double width = canvas.text_width(text, style) + 36;
  const Point at{kCentre.x, kCentre.y + 0.45 * kRadius};
  canvas.rectangle({at.x - 0.5 * width, at.y - 17, width, 34}, kPaper, Stroke{kVermilion, 1.6});
  canvas.text(at, text, style);
}

void draw_legend(Canvas& canvas, const SkyDrawing& drawing, bool fisheye) {
  const double x = kCentre.x + kRadius + 62;
  double y = kCentre.y - kRadius + 10;
  canvas.text({x, y}, "Satellites", {.size = 13, .bold = true});
  y += 26;
  for (const Visibility visibility : kVisibilities) {
    const auto count = std::count_if(drawing.satellites.begin(), drawing.satellites.end(),
                                     [&](const SkySatellite& s) { return s.now.visibility == visibility; });
    draw_satellite_mark(canvas, {x + 10, y}, visibility);
    canvas.text({x + 30, y}, std::string(propagation::name(visibility)),
                {.size = 12, .level = TextLevel::Middle});
    canvas.text({x + 172, y}, fmt::format("{}", count),
                {.size = 12, .align = Align::Right, .level = TextLevel::Middle});
    y += 25;
  }
  if (drawing.has_fix) {
    const auto used = std::count_if(drawing.satellites.begin(), drawing.satellites.end(),
                                    [](const SkySatellite& s) { return s.used; });
    canvas.text({x, y}, "G05", {.size = 12, .bold = true, .level = TextLevel::Middle});
    canvas.text({x + 36, y}, "used in the fix", {.size = 12, .level = TextLevel::Middle});
    canvas.text({x + 172, y}, fmt::format("{}", used),
                {.size = 12, .align = Align::Right, .level = TextLevel::Middle});
    y += 25;
  }
  if (fisheye) {
    // Reflections are always in the legend, other kinds of path only if present.
    for (const auto& [kind, text] : {std::pair{PathKind::Diffuse, "scattered by a facade"},
                                     {PathKind::Diffracted, "bent around an edge"},
                                     {PathKind::Reflected, "arrives by reflection"}}) {
      const auto is_of_kind = [wanted = kind](const SkyReflection& r) { return r.kind == wanted; };
      if (kind != PathKind::Reflected &&
          std::none_of(drawing.satellites.begin(), drawing.satellites.end(), [&](const SkySatellite& s) {
            return std::any_of(s.reflections.begin(), s.reflections.end(), is_of_kind);
          }))
        continue;
      draw_reflection_mark(canvas, {x + 10, y}, Visibility::NLOS, kind);
      canvas.text({x + 30, y}, text, {.size = 12, .level = TextLevel::Middle});
      y += 18;
    }
    canvas.text({x + 30, y}, "+34 m: longer by this",
                {.size = 10.5, .colour = kFaintInk, .level = TextLevel::Middle});
    y += 25;
  }
  y += 19;

  canvas.text({x, y}, "Sky", {.size = 13, .bold = true});
  y += 24;
  if (!drawing.mask.azimuths.empty()) {
    canvas.rectangle({x, y - 8, 20, 15}, fisheye ? kSkyWall : kSkySilhouette, Stroke{kFaintInk, 0.6});
    canvas.text({x + 30, y}, fmt::format("hidden ({:.0f} %)", 100 * drawing.mask.hidden_fraction()),
                {.size = 12, .level = TextLevel::Middle});
    y += 25;
  }
  if (drawing.elevation_mask_rad > 0) {
    canvas.polyline({{x, y}, {x + 20, y}}, {kVermilion, 1.3, {5, 4}});
    canvas.text(
        {x + 30, y},
        fmt::format("mask {:g}\u00B0", std::round(geodesy::degrees(drawing.elevation_mask_rad) * 10) / 10),
        {.size = 12, .level = TextLevel::Middle});
    y += 25;
  }
  if (std::any_of(drawing.satellites.begin(), drawing.satellites.end(),
                  [](const SkySatellite& s) { return !s.trails.empty(); })) {
    canvas.polyline({{x, y}, {x + 20, y}}, {colour_of(Visibility::LOS), 2.6});
    canvas.text({x + 30, y}, drawing.trail_meaning, {.size = 12, .level = TextLevel::Middle});
    y += 25;
  }
  if (fisheye) draw_fisheye_notes(canvas, {x, y});
}

void draw_reflections(Canvas& canvas, const SkyLens& lens, const SkyDrawing& drawing, SkyLabels& labels) {
  struct Mark {
    Point at;
    std::size_t number = 0;
    double excess_m = 0;
  };
  std::vector<Mark> marks;
  // Lines first, so that no line crosses a mark.
  for (const bool lines : {true, false}) {
    for (const SkySatellite& s : drawing.satellites) {
      const Point from = lens.point(s.now.azimuth_rad, s.now.elevation_rad);
      for (const SkyReflection& r : s.reflections) {
        if (!(r.elevation_rad >= 0)) continue;
        const Point at = lens.point(r.azimuth_rad, r.elevation_rad);
        const bool diffuse = r.kind == PathKind::Diffuse;  // one of many paths: paler, without a name
        if (lines) {
          canvas.polyline({from, at}, {kPaper.with_alpha(diffuse ? 0.2 : 0.5), 2.6});
          canvas.polyline({from, at},
                          {colour_of(s.now.visibility).with_alpha(diffuse ? 0.4 : 1), 1.2, {5, 3}});
        } else {
          draw_reflection_mark(canvas, at, s.now.visibility, r.kind);
          const std::size_t number = labels.add_mark(at, diffuse ? 4 : 7);
          if (!diffuse) marks.push_back({at, number, r.excess_m});
        }
      }
    }
  }
  for (const Mark& mark : marks) {
    labels.draw(canvas, mark.at, mark.number, fmt::format("+{:.0f} m", mark.excess_m),
                {.size = 10.5, .halo = 2, .halo_colour = kPaper.with_alpha(0.85)});
  }
}

/// Draws everything but the background; `draw_background` puts it on the disc.
void draw_sheet(Canvas& canvas, const SkyDrawing& drawing, const SkyLens& lens,
                const std::function<void(Canvas&)>& draw_background) {
  const bool fisheye = lens.looking_up;
  draw_title(canvas, kCentre.x - kRadius - 30, drawing.title, drawing.subtitle);
  draw_background(canvas);
  draw_sky_grid(canvas, lens, drawing.elevation_mask_rad);
  for (const SkySatellite& s : drawing.satellites)
    for (const auto& trail : s.trails) draw_trail(canvas, lens, trail, fisheye);
  SkyLabels labels;
  for (const SkySatellite& s : drawing.satellites)
    labels.add_mark(lens.point(s.now.azimuth_rad, s.now.elevation_rad), 8);
  for (int azimuth_deg = 0; azimuth_deg < 360; azimuth_deg += 30)
    labels.add_mark(sky_rim_label(lens, azimuth_deg), 9);
  if (fisheye) draw_reflections(canvas, lens, drawing, labels);
  for (const SkySatellite& s : drawing.satellites)
    draw_satellite_mark(canvas, lens.point(s.now.azimuth_rad, s.now.elevation_rad), s.now.visibility);
  for (std::size_t i = 0; i < drawing.satellites.size(); ++i) {
    const SkySatellite& s = drawing.satellites[i];
    labels.draw(canvas, lens.point(s.now.azimuth_rad, s.now.elevation_rad), i, s.name,
                {.size = 12.5,
                 .colour = s.now.visibility == Visibility::Blocked ? kFaintInk : kInk,
                 .bold = drawing.has_fix && s.used,
                 .halo = 2.2,
                 .halo_colour = kPaper.with_alpha(0.85)});
  }
  draw_containment(canvas, drawing.containment);
  draw_legend(canvas, drawing, fisheye);
}

std::string render_sheet(const SkySheet& sheet, const std::function<void(Canvas&)>& draw) {
  if (sheet.format == PictureFormat::Svg) return render_svg(kSkyWidth, kSkyHeight, draw);
  return render_png(sheet.width_px, static_cast<int>(std::lround(sheet.width_px * kSkySheetAspect)),
                    sheet.width_px / kSkyWidth, draw);
}

std::function<void(Canvas&)> chart(const SkyDrawing& drawing) {
  return [&drawing](Canvas& canvas) {
    const SkyLens lens = sky_sheet_lens(drawing.projection, false);
    draw_sheet(canvas, drawing, lens, [&](Canvas& c) {
      c.circle(kCentre, kRadius, kGround);
      draw_sky_mask(c, lens, drawing.mask);
    });
  };
}

}  // namespace

void SkySheet::validate() const {
  options::check(*this, "sky picture");
}

void visit(options::Visitor& v, SkySheet& o) {
  static constexpr std::string_view kFormats[]{"png", "svg"};
  v.choice({"format", "", "of the file"}, o.format, kFormats);
  v.integer({"width_px", "px", "of a PNG; the height is 836/990 of it"}, o.width_px, 200, 4000);
}

SkyLens sky_sheet_lens(SkyProjection projection, bool looking_up) {
  return {kCentre, kRadius, projection, looking_up};
}

Picture draw_sky(const SkyDrawing& drawing) {
  return render(kSkyWidth, kSkyHeight, chart(drawing));
}

std::string draw_sky(const SkyDrawing& drawing, const SkySheet& sheet) {
  sheet.validate();
  return render_sheet(sheet, chart(drawing));
}

std::string draw_fisheye(const SkyDrawing& drawing, const SkySurroundings& surroundings,
                         const SkySheet& sheet) {
  sheet.validate();
  // The image covers whole pixels, so that it is drawn without scaling.
  const double scale = sheet.width_px / kSkyWidth;
  const double left = std::floor((kCentre.x - kRadius) * scale),
               top = std::floor((kCentre.y - kRadius) * scale);
  const int width = static_cast<int>(std::ceil((kCentre.x + kRadius) * scale) - left);
  const int height = static_cast<int>(std::ceil((kCentre.y + kRadius) * scale) - top);
  const SkyLens pixels{
      {kCentre.x * scale - left, kCentre.y * scale - top}, kRadius * scale, drawing.projection, true};
  const RgbImage image =
      render_sky(*surroundings.scene, *surroundings.mesh, surroundings.antenna_enu, pixels, width, height);
  return render_sheet(sheet, [&](Canvas& canvas) {
    draw_sheet(canvas, drawing, sky_sheet_lens(drawing.projection, true), [&](Canvas& c) {
      c.image({left / scale, top / scale, width / scale, height / scale}, width, height, image.pixels);
    });
  });
}

}  // namespace canyon::drawing
