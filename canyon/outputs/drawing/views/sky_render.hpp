#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string_view>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/fwd.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/outputs/drawing/canvas.hpp"

namespace canyon::drawing {

/// Distance of a direction from the centre as a fraction of the radius, by its angle z from the zenith.
enum class SkyProjection : std::uint8_t {
  Equidistant,    ///< 2 z / pi: elevation decreases linearly towards the rim
  Stereographic,  ///< tan(z / 2): conformal: keeps angles and small shapes
};
/// "equidistant", "stereographic".
[[nodiscard]] std::string_view name(SkyProjection projection);

/// The upper half of the celestial sphere as a disc: zenith in the middle, horizon on the rim, north up.
struct SkyLens {
  Point centre;
  double radius = 1;  ///< of the horizon, in the units of `centre`; > 0
  SkyProjection projection = SkyProjection::Equidistant;
  /// True: viewed from below, as by a camera, east to the left. False: as on a map, east to the right.
  bool looking_up = false;

  /// The point of a direction. Azimuth from north, clockwise, any finite value; elevation [0, pi/2], both in
  /// rad. Below the horizon the same formula continues outside the rim.
  [[nodiscard]] Point point(double azimuth_rad, double elevation_rad) const;
  /// Distance of an elevation from the centre as a fraction of the radius: 0 at the zenith, 1 at the horizon.
  [[nodiscard]] double reach(double elevation_rad) const;
  /// The inverse of point(), to rounding: the direction drawn at a point; empty outside the disc.
  [[nodiscard]] std::optional<geodesy::AzimuthElevation> direction(const Point& at) const;
};

/// The spacing [m] of the thin lines on walls that mark heights above the antenna.
inline constexpr double kWallLines_m = 10;
/// Colour of walls in full light.
inline constexpr Colour kSkyWall = rgb(0xCBBCA8);

/// Renders the view of an upward camera: open sky is paler towards the horizon; surfaces are lit from the
/// south-west, darker towards the ground and paler with distance, with a line every kWallLines_m of height.
/// Pixels outside the lens's disc have the colour of paper. Casts a ray for each pixel, and more if
/// neighbours differ. Rows run in parallel; the pixels do not depend on the number of threads.
/// @param scene with its movable objects as of its last commit()
/// @param mesh the static city that the scene was built from
/// @param antenna_enu finite, in the city's frame [m]; directions are in that frame too; its vertical differs
/// from the antenna's by 1e-4 rad some 600 m from the origin
/// @param lens in pixels from the top left corner of the picture; the centre of the first pixel is (0.5, 0.5)
[[nodiscard]] RgbImage render_sky(const raytrace::RayScene& scene, const city::Mesh& mesh,
                                  const Eigen::Vector3d& antenna_enu, const SkyLens& lens, int width,
                                  int height);

}  // namespace canyon::drawing
