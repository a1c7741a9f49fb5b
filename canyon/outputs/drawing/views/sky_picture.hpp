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

/// A direction and what arrived from there.
struct SkyPoint {
  double azimuth_rad = 0;    ///< from north, clockwise
  double elevation_rad = 0;  ///< >= 0
  propagation::Visibility visibility = propagation::Visibility::Blocked;
};

/// The direction from which a signal arrives that does not come straight.
struct SkyReflection {
  double azimuth_rad = 0;    ///< from north, clockwise
  double elevation_rad = 0;  ///< below 0 (off the ground) it is not drawn
  double excess_m = 0;       ///< longer than the straight line by this much
  propagation::PathKind kind = propagation::PathKind::Reflected;  ///< any but Direct
};

struct SkySatellite {
  std::string name;  ///< "G05"
  SkyPoint now;
  bool used = false;  ///< in the fix
  /// The track over the run: one piece for each stretch above the horizon, in order of time; may be empty.
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
  bool has_fix = true;  ///< else `used` has no meaning, and the legend leaves it out
  std::string trail_meaning = "way over the run";  ///< for the legend
  /// Where the antenna is; unless it is free, a note on the picture says why nothing is received.
  raytrace::Placement placement = raytrace::Placement::Free;
};

/// The sky over one place, seen as on a map: zenith in the middle, north up, east to the right, elevation
/// falling towards the horizon by the drawing's projection. Satellites differ by shape and colour:
/// LOS disc, LOS with multipath ringed disc, NLOS triangle, blocked cross; names of those in the fix are
/// bold.
[[nodiscard]] Picture draw_sky(const SkyDrawing& drawing);

enum class PictureFormat : std::uint8_t { Png, Svg };

/// Format and size of a sky picture's file.
struct SkySheet {
  PictureFormat format = PictureFormat::Png;
  /// Pixels across a PNG, [200, 4000]; kSkySheetAspect of it high. An SVG is always of the same size, and its
  /// pixels (draw_fisheye) are as fine as those of a PNG of this width.
  int width_px = 1980;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
/// Visits its fields.
void visit(options::Visitor& v, SkySheet& o);
/// Height over width of a sky picture; 990 x 836 and 1980 x 1672 are whole.
inline constexpr double kSkySheetAspect = 836.0 / 990.0;

/// draw_sky() as one file; bytes of it. Throws InputError for a sheet that does not validate().
[[nodiscard]] std::string draw_sky(const SkyDrawing& drawing, const SkySheet& sheet);

/// The surroundings of a place, for render_sky(); no pointer may be null.
struct SkySurroundings {
  const raytrace::RayScene* scene = nullptr;
  const city::Mesh* mesh = nullptr;
  Eigen::Vector3d antenna_enu = Eigen::Vector3d::Zero();
};

/// The same sky as an upward fish-eye camera sees it (render_sky()): north up and east to the LEFT, which the
/// legend says. Beside the satellites the directions from which other signals than the direct one arrive are
/// marked, joined to their satellite: diamonds for reflected ones, squares for those bent around edges, both
/// with the excess path beside them; small pale discs for scattered ones. Bytes of the file. Throws
/// InputError for a sheet that does not validate().
[[nodiscard]] std::string draw_fisheye(const SkyDrawing& drawing, const SkySurroundings& surroundings,
                                       const SkySheet& sheet);

/// Where both kinds of picture have their disc, in the units of a sheet 990 wide.
[[nodiscard]] SkyLens sky_sheet_lens(SkyProjection projection, bool looking_up);

}  // namespace canyon::drawing
