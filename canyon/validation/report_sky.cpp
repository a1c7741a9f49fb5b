#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "canyon/geodesy/time_scales.hpp"
#include "canyon/output/map_marks.hpp"
#include "canyon/output/number.hpp"
#include "canyon/output/sky_marks.hpp"
#include "canyon/output/sky_mask.hpp"
#include "canyon/validation/report_pictures.hpp"
#include "canyon/validation/report_samples.hpp"

namespace canyon::validation {
namespace {

using output::Canvas;
using output::Level;
using output::Point;

constexpr double kRadius = 320, kWidth = 1010, kHeight = 800;
constexpr Point kCentre{386, 440};

/// Disc for LOS, triangle for NLOS; filled by C/N0, hollow where none was measured.
void draw_satellite(Canvas& canvas, const Point& at, bool clear, const std::optional<output::Colour>& fill) {
  const output::Stroke rim{output::kInk, 1.3};
  const output::Colour inside = fill.value_or(output::kPaper);
  if (clear) {
    canvas.circle(at, 8.5, inside, rim);
  } else {
    canvas.polygons({{{at.x, at.y - 11}, {at.x + 10, at.y + 7.5}, {at.x - 10, at.y + 7.5}}}, inside, rim);
  }
}

output::Scale cn0_scale(std::span<const ComparedSatellite> satellites) {
  double low = 1e9, high = -1e9;
  for (const ComparedSatellite& s : satellites) {
    if (!s.measured || !s.measured_cn0_dbhz) continue;
    low = std::min(low, *s.measured_cn0_dbhz);
    high = std::max(high, *s.measured_cn0_dbhz);
  }
  return low <= high ? output::linear_scale(low, high, 5) : output::linear_scale(20, 50, 6);
}

void draw_key(Canvas& canvas, std::span<const ComparedSatellite> satellites, const output::SkyMask& mask,
              const output::Scale& scale) {
  const double x = kCentre.x + kRadius + 62;
  double y =
      output::draw_colour_bar(canvas, {x, 150, 18, 190}, "Measured C/N0 [dB-Hz]", scale, output::viridis) +
      40;
  const auto count = [&](bool clear, bool measured) {
    return std::count_if(satellites.begin(), satellites.end(), [&](const ComparedSatellite& s) {
      return s.clear == clear && s.measured == measured;
    });
  };
  const auto entry = [&](bool clear, bool measured, const std::string& label) {
    draw_satellite(canvas, {x + 10, y}, clear, measured ? std::optional(output::viridis(0.6)) : std::nullopt);
    canvas.text({x + 30, y}, label, {.size = 12, .level = Level::Middle});
    canvas.text({x + 190, y}, fmt::format("{}", count(clear, measured)),
                {.size = 12, .align = output::Align::Right, .level = Level::Middle});
    y += 27;
  };
  entry(true, true, "LOS");
  entry(false, true, "NLOS");
  entry(true, false, "LOS, not recorded");
  entry(false, false, "NLOS, not recorded");
  canvas.rectangle({x, y - 8, 20, 15}, output::kSkySilhouette, output::Stroke{output::kFaintInk, 0.6});
  canvas.text({x + 30, y},
              fmt::format("hidden ({} % of the sky)", output::fixed(100 * mask.hidden_share(), 0)),
              {.size = 12, .level = Level::Middle});
  y += 34;
  canvas.text({x, y}, "N up, E right, zenith in the middle,", {.size = 11, .colour = output::kFaintInk});
  canvas.text({x, y + 17}, "horizon on the rim", {.size = 11, .colour = output::kFaintInk});
}

}  // namespace

output::Picture draw_report_sky(const ReportInput& input) {
  if (input.count == 0) {
    return output::draw_notice("Sky and measured C/N0", report_subtitle(input), "no epoch");
  }
  const Comparison& comparison = *input.comparison;
  const ComparedEpoch& epoch = comparison.epochs[richest_epoch(comparison, input.first, input.count)];
  const auto satellites = satellites_of(comparison, epoch);
  const output::SkyMask mask = output::make_sky_mask(input.environment->scene(), epoch.place_enu_m);
  const output::Scale scale = cn0_scale(satellites);
  return output::render(kWidth, kHeight, [&](Canvas& canvas) {
    const output::SkyLens lens{kCentre, kRadius, output::SkyProjection::Equidistant, false};
    output::draw_title(canvas, 40, fmt::format("Sky and measured C/N0 at {} GPST", clock_gpst(epoch.time)),
                       report_subtitle(input));
    canvas.circle(kCentre, kRadius, output::kGround);
    // The city may have been turned against the sky: counter-clockwise, azimuths count the other way.
    output::draw_sky_mask(canvas, lens, mask, -comparison.registration.heading_rad);
    output::draw_sky_grid(canvas, lens, 0);
    output::SkyLabels labels;
    for (const ComparedSatellite& s : satellites) {
      labels.add_mark(lens.point(s.azimuth_rad, s.elevation_rad), 10);
    }
    for (int azimuth_deg = 0; azimuth_deg < 360; azimuth_deg += 30) {
      labels.add_mark(output::sky_rim_label(lens, azimuth_deg), 9);
    }
    for (const ComparedSatellite& s : satellites) {
      std::optional<output::Colour> fill;
      if (s.measured && s.measured_cn0_dbhz) fill = output::viridis(scale.at(*s.measured_cn0_dbhz));
      draw_satellite(canvas, lens.point(s.azimuth_rad, s.elevation_rad), s.clear, fill);
    }
    for (std::size_t i = 0; i < satellites.size(); ++i) {
      const ComparedSatellite& s = satellites[i];
      labels.draw(canvas, lens.point(s.azimuth_rad, s.elevation_rad), i, orbit::to_string(s.id),
                  {.size = 12.5,
                   .colour = s.measured ? output::kInk : output::kFaintInk,
                   .halo = 2.2,
                   .halo_colour = output::kPaper.with_alpha(0.85)});
    }
    if (satellites.empty()) {
      canvas.text(kCentre, "no satellite",
                  {.size = 15, .align = output::Align::Centre, .level = Level::Middle, .halo = 3});
    }
    draw_key(canvas, satellites, mask, scale);
  });
}

}  // namespace canyon::validation
