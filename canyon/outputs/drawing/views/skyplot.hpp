#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "canyon/base/options/fwd.hpp"
#include "canyon/outputs/drawing/views/sky_picture.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/run/environment.hpp"

namespace canyon::drawing {

enum class SkyStyle : std::uint8_t {
  Chart,    ///< draw_sky(): a map of the sky, silhouette in one tone
  Fisheye,  ///< draw_fisheye(): as an upward camera sees it
};

struct SkyplotOptions {
  SkyStyle style = SkyStyle::Chart;
  SkyProjection projection = SkyProjection::Equidistant;
  SkySheet sheet;
  /// Satellites' tracks of so many seconds before, up to now, as they would have been received at this place.
  /// [0, 86,400]; 0: none.
  double trail_s = 0;
  double elevation_mask_rad = 0;  ///< drawn only, [0, pi/2)
  std::string receiver;           ///< for the title; may be empty
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
/// Visits its fields.
void visit(options::Visitor& v, SkyplotOptions& o);

/// Contents of a picture of the sky at a place and time: satellites above the horizon with their visibility,
/// reflections and tracks, the silhouette, title and subtitle. Nothing is made up:
/// without a satellite the list is empty; in a building every satellite is blocked and `placement` says so.
/// @param antenna_enu in the city's frame [m], finite (InputError)
/// @param propagator of this environment
/// @param receiver whose reception decides visibility, in steady state and without shadowing: signals too
/// weak for it are blocked and not drawn; null: every signal that arrives, however weak
[[nodiscard]] SkyDrawing make_sky_drawing(const simulation::Environment& environment,
                                          const propagation::Propagator& propagator, geodesy::GpsTime time,
                                          const Eigen::Vector3d& antenna_enu, const SkyplotOptions& options,
                                          const receiver::ReceiverOptions* receiver = nullptr);

/// That drawing as a file; bytes of it, the same on any number of threads. Throws InputError for options that
/// do not validate() and for a place that is not finite.
[[nodiscard]] std::string draw_skyplot(const simulation::Environment& environment,
                                       const propagation::Propagator& propagator, geodesy::GpsTime time,
                                       const Eigen::Vector3d& antenna_enu, const SkyplotOptions& options,
                                       const receiver::ReceiverOptions* receiver = nullptr);

}  // namespace canyon::drawing
