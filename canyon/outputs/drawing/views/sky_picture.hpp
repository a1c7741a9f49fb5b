#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "canyon/base/options/fwd.hpp"
#include "canyon/city/fwd.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/outputs/drawing/canvas.hpp"
#include "canyon/outputs/drawing/views/sky_mask.hpp"
#include "canyon/outputs/drawing/views/sky_render.hpp"
#include "canyon/paths/propagation/paths.hpp"

namespace canyon::drawing {

/// A direction and the visibility of the signal from it.
struct SkyPoint {
  double azimuth_rad = 0;    ///< from north, clockwise
  double elevation_rad = 0;  ///< >= 0
  propagation::Visibility visibility = propagation::Visibility::Blocked;
};

/// The direction of arrival of an indirect signal.
struct SkyReflection {
  double azimuth_rad = 0;                                         ///< from north, clockwise
  double elevation_rad = 0;                                       ///< not drawn below 0 (ground reflection)
  double excess_m = 0;                                            ///< path length minus the straight line
  propagation::PathKind kind = propagation::PathKind::Reflected;  ///< any but Direct
};

struct SkySatellite {
  std::string name;  ///< "G05"
  SkyPoint now;
  bool used = false;  ///< in the fix
  /// The track over the run: one piece for each interval above the horizon, in order of time; may be empty.
  std::vector<std::vector<SkyPoint>> trails;
  std::vector<SkyReflection> reflections = {};  ///< drawn by draw_fisheye() only
};

struct SkyDrawing {
  std::string title;
  std::string subtitle;
  std::vector<SkySatellite> satellites;  ///< above the horizon
  SkyMask mask;                          ///< may be empty
  double elevation_mask_rad = 0;
  SkyProjection projection = SkyProjection::Equidistant;
  bool has_fix = true;  ///< if false, `used` has no meaning and is not in the legend
  std::string trail_meaning = "way over the run";  ///< for the legend
  /// Unless the antenna is free, a note on the picture gives the reason why nothing is received.
  raytrace::Containment containment = raytrace::Containment::Free;
};

/// The sky over one point, seen as on a map: zenith in the middle, north up, east to the right, elevation
/// decreasing towards the horizon by the drawing's projection. Satellites differ by shape and colour: LOS
/// disc, LOS with multipath ringed disc, NLOS triangle, blocked cross; bold names: in the fix.
[[nodiscard]] Picture draw_sky(const SkyDrawing& drawing);

enum class PictureFormat : std::uint8_t { Png, Svg };

/// Format and size of a sky picture's file.
struct SkySheet {
  PictureFormat format = PictureFormat::Png;
  /// Pixels across a PNG, [200, 4000]; the height is kSkySheetAspect times the width. An SVG always has the
  /// same size; its pixels (draw_fisheye) are those of a PNG of this width.
  int width_px = 1980;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
void visit(options::Visitor& v, SkySheet& o);
/// Height over width of a sky picture; 990 x 836 and 1980 x 1672 are whole.
inline constexpr double kSkySheetAspect = 836.0 / 990.0;

/// draw_sky() as one file; returns its bytes. Throws InputError for a sheet that does not validate().
[[nodiscard]] std::string draw_sky(const SkyDrawing& drawing, const SkySheet& sheet);

/// The surroundings of an antenna, for render_sky(); no pointer may be null.
struct SkySurroundings {
  const raytrace::RayScene* scene = nullptr;
  const city::Mesh* mesh = nullptr;
  Eigen::Vector3d antenna_enu = Eigen::Vector3d::Zero();
};

/// The sky in the view of an upward fish-eye camera (render_sky()): north up and east to the LEFT, as noted
/// in the legend. Directions of arrival of indirect signals are also marked and joined to their satellite:
/// diamonds for reflected, squares for diffracted signals, both with their excess path; small pale discs for
/// scattered signals. Returns the bytes of the file. Throws InputError for a sheet that does not validate().
[[nodiscard]] std::string draw_fisheye(const SkyDrawing& drawing, const SkySurroundings& surroundings,
                                       const SkySheet& sheet);

/// The disc of both kinds of picture, in units of a sheet 990 wide.
[[nodiscard]] SkyLens sky_sheet_lens(SkyProjection projection, bool looking_up);

}  // namespace canyon::drawing
