#pragma once

#include <string>
#include <vector>

#include "canyon/output/canvas.hpp"
#include "canyon/output/sky_mask.hpp"
#include "canyon/propagation/paths.hpp"

namespace canyon::output {

/// A direction and what arrived from there.
struct SkyPoint {
  double azimuth_rad = 0;    ///< from north, clockwise
  double elevation_rad = 0;  ///< >= 0
  propagation::Visibility visibility = propagation::Visibility::Blocked;
};

struct SkySatellite {
  std::string name;  ///< "G05"
  SkyPoint now;
  bool used = false;  ///< in the fix
  /// Over the run, in order of time: one piece for each stretch above the horizon; may be empty.
  std::vector<std::vector<SkyPoint>> trails;
};

struct SkyDrawing {
  std::string title;
  std::string subtitle;
  std::vector<SkySatellite> satellites;  ///< above the horizon
  SkyMask mask;                          ///< may be empty
  double elevation_mask_rad = 0;
};

/// The sky over one place, seen as on a map: zenith in the middle, north up, east to the right, elevation
/// falling evenly towards the horizon. Satellites are told apart by shape and colour: LOS disc, LOS with
/// multipath ringed disc, NLOS triangle, blocked cross; names of those in the fix are bold.
[[nodiscard]] Picture draw_sky(const SkyDrawing& drawing);

}  // namespace canyon::output
