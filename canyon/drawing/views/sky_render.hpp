#pragma once

#include <Eigen/Core>

#include "canyon/city/fwd.hpp"
#include "canyon/drawing/views/city_render.hpp"
#include "canyon/drawing/views/sky_lens.hpp"
#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::drawing {

/// The distance [m] of the thin lines on walls that mark heights above the antenna.
inline constexpr double kWallLines_m = 10;
/// Colour of walls in full light.
inline constexpr Colour kSkyWall = rgb(0xCBBCA8);

/// Draws the view of an upward camera: open sky is paler towards the horizon; surfaces are lit from the
/// south-west, darker towards the ground and paler with distance, with a line every kWallLines_m of height.
/// Pixels outside the lens's disc are paper. Casts a ray for each pixel, more where neighbours differ; rows
/// in parallel, the same pixels on any number of threads.
/// @param scene with its movable things as of its last commit()
/// @param mesh the static city that the scene was built from
/// @param antenna_enu finite, in the city's frame [m]; directions are taken in that frame as well, whose
/// vertical differs from the antenna's by 1e-4 rad some 600 m from the origin
/// @param lens in pixels from the top left corner of the picture; the first pixel's middle is (0.5, 0.5)
[[nodiscard]] RgbImage render_sky(const raytrace::RayScene& scene, const city::Mesh& mesh,
                                  const Eigen::Vector3d& antenna_enu, const SkyLens& lens, int width,
                                  int height);

}  // namespace canyon::drawing
