// Declared in canyon/validation/report/report_pictures.hpp.
#include <fmt/format.h>

#include <algorithm>

#include "canyon/drawing/views/map_marks.hpp"
#include "canyon/drawing/views/sky_marks.hpp"
#include "canyon/drawing/views/sky_mask.hpp"
#include "canyon/output/number.hpp"
#include "canyon/validation/report/report_pictures.hpp"
#include "canyon/validation/report/report_samples.hpp"

namespace canyon::validation {
namespace {

using drawing::Canvas;
using drawing::Level;
using drawing::Point;

constexpr double kRadius = 320, kSkyWidth = 1010, kSkyHeight = 800;
constexpr Point kCentre{386, 440};

/// Disc for LOS, triangle for NLOS; filled by C/N0, hollow where none was measured.
void draw_satellite(Canvas& canvas, const Point& at, bool clear, const std::optional<drawing::Colour>& fill) {
  const drawing::Stroke rim{drawing::kInk, 1.3};
  const drawing::Colour inside = fill.value_or(drawing::kPaper);
  if (clear) {
    canvas.circle(at, 8.5, inside, rim);
  } else {
    canvas.polygons({{{at.x, at.y - 11}, {at.x + 10, at.y + 7.5}, {at.x - 10, at.y + 7.5}}}, inside, rim);
  }
}

drawing::Scale cn0_scale(std::span<const ComparedSatellite> satellites) {
  double low = 1e9, high = -1e9;
  for (const ComparedSatellite& s : satellites) {
    if (!s.measured || !s.measured_cn0_dbhz) continue;
    low = std::min(low, *s.measured_cn0_dbhz);
    high = std::max(high, *s.measured_cn0_dbhz);
  }
  return low <= high ? drawing::linear_scale(low, high, 5) : drawing::linear_scale(20, 50, 6);
}

void draw_key(Canvas& canvas, std::span<const ComparedSatellite> satellites, const drawing::SkyMask& mask,
              const drawing::Scale& scale) {
  const double x = kCentre.x + kRadius + 62;
  double y =
      drawing::draw_colour_bar(canvas, {x, 150, 18, 190}, "Measured C/N0 [dB-Hz]", scale, drawing::viridis) +
      40;
  const auto count = [&](bool clear, bool measured) {
    return std::count_if(satellites.begin(), satellites.end(), [&](const ComparedSatellite& s) {
      return s.clear == clear && s.measured == measured;
    });
  };
  const auto entry = [&](bool clear, bool measured, const std::string& label) {
    draw_satellite(canvas, {x + 10, y}, clear,
                   measured ? std::optional(drawing::viridis(0.6)) : std::nullopt);
    canvas.text({x + 30, y}, label, {.size = 12, .level = Level::Middle});
    canvas.text({x + 190, y}, fmt::format("{}", count(clear, measured)),
                {.size = 12, .align = drawing::Align::Right, .level = Level::Middle});
    y += 27;
  };
  entry(true, true, "LOS");
  entry(false, true, "NLOS");
  entry(true, false, "LOS, not recorded");
  entry(false, false, "NLOS, not recorded");
  canvas.rectangle({x, y - 8, 20, 15}, drawing::kSkySilhouette, drawing::Stroke{drawing::kFaintInk, 0.6});
  canvas.text({x + 30, y},
              fmt::format("hidden ({} % of the sky)", output::fixed(100 * mask.hidden_share(), 0)),
              {.size = 12, .level = Level::Middle});
  y += 34;
  canvas.text({x, y}, "N up, E right, zenith in the middle,", {.size = 11, .colour = drawing::kFaintInk});
  canvas.text({x, y + 17}, "horizon on the rim", {.size = 11, .colour = drawing::kFaintInk});
}

}  // namespace

drawing::Picture draw_report_sky(const ReportInput& input) {
  if (input.count == 0) {
    return drawing::draw_notice("Sky and measured C/N0", report_subtitle(input), "no epoch");
  }
  const Comparison& comparison = *input.comparison;
  const ComparedEpoch& epoch = comparison.epochs[richest_epoch(comparison, input.first, input.count)];
  const auto satellites = satellites_of(comparison, epoch);
  const drawing::SkyMask mask = drawing::make_sky_mask(input.environment->scene(), epoch.place_enu_m);
  const drawing::Scale scale = cn0_scale(satellites);
  return drawing::render(kSkyWidth, kSkyHeight, [&](Canvas& canvas) {
    const drawing::SkyLens lens{kCentre, kRadius, drawing::SkyProjection::Equidistant, false};
    drawing::draw_title(canvas, 40, fmt::format("Sky and measured C/N0 at {} GPST", clock_gpst(epoch.time)),
                        report_subtitle(input));
    canvas.circle(kCentre, kRadius, drawing::kGround);
    // The city may have been turned against the sky: counter-clockwise, azimuths count the other way.
    drawing::draw_sky_mask(canvas, lens, mask, -comparison.registration.heading_rad);
    drawing::draw_sky_grid(canvas, lens, 0);
    drawing::SkyLabels labels;
    for (const ComparedSatellite& s : satellites) {
      labels.add_mark(lens.point(s.azimuth_rad, s.elevation_rad), 10);
    }
    for (int azimuth_deg = 0; azimuth_deg < 360; azimuth_deg += 30) {
      labels.add_mark(drawing::sky_rim_label(lens, azimuth_deg), 9);
    }
    for (const ComparedSatellite& s : satellites) {
      std::optional<drawing::Colour> fill;
      if (s.measured && s.measured_cn0_dbhz) fill = drawing::viridis(scale.at(*s.measured_cn0_dbhz));
      draw_satellite(canvas, lens.point(s.azimuth_rad, s.elevation_rad), s.clear, fill);
    }
    for (std::size_t i = 0; i < satellites.size(); ++i) {
      const ComparedSatellite& s = satellites[i];
      labels.draw(canvas, lens.point(s.azimuth_rad, s.elevation_rad), i, gnss::to_string(s.id),
                  {.size = 12.5,
                   .colour = s.measured ? drawing::kInk : drawing::kFaintInk,
                   .halo = 2.2,
                   .halo_colour = drawing::kPaper.with_alpha(0.85)});
    }
    if (satellites.empty()) {
      canvas.text(kCentre, "no satellite",
                  {.size = 15, .align = drawing::Align::Centre, .level = Level::Middle, .halo = 3});
    }
    draw_key(canvas, satellites, mask, scale);
  });
}

}  // namespace canyon::validation
