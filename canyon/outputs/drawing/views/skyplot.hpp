#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "canyon/base/options/fwd.hpp"
#include "canyon/outputs/drawing/views/sky_picture.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/environment.hpp"

namespace canyon::drawing {

enum class SkyStyle : std::uint8_t {
  Chart,    ///< draw_sky(): a map of the sky, silhouette in one tone
  Fisheye,  ///< draw_fisheye(): the view of an upward camera
};

struct SkyplotOptions {
  SkyStyle style = SkyStyle::Chart;
  SkyProjection projection = SkyProjection::Equidistant;
  SkySheet sheet;
  /// Length of the satellites' tracks up to now [s], as seen from this point. [0, 86,400]; 0: none.
  double trail_s = 0;
  double elevation_mask_rad = 0;  ///< drawn only, [0, pi/2)
  std::string receiver;           ///< for the title; may be empty
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
void visit(options::Visitor& v, SkyplotOptions& o);

/// Contents of a picture of the sky at a point and time: satellites above the horizon with their visibility,
/// reflections and tracks, the silhouette, title and subtitle. Without a satellite the list is empty; in a
/// building every satellite is blocked and `containment` is set.
/// @param antenna_enu in the city's frame [m], finite (InputError)
/// @param propagator of this environment
/// @param receiver that determines visibility, in steady state and without shadowing: signals too weak for it
/// are blocked and not drawn; null: every arriving signal, however weak
[[nodiscard]] SkyDrawing make_sky_drawing(const simulation::Environment& environment,
                                          const propagation::Propagator& propagator, geodesy::GpsTime time,
                                          const Eigen::Vector3d& antenna_enu, const SkyplotOptions& options,
                                          const receiver::ReceiverOptions* receiver = nullptr);

/// Draws it as a file; returns its bytes, which do not depend on the number of threads. Throws InputError for
/// options that do not validate() and for a non-finite position.
[[nodiscard]] std::string draw_skyplot(const simulation::Environment& environment,
                                       const propagation::Propagator& propagator, geodesy::GpsTime time,
                                       const Eigen::Vector3d& antenna_enu, const SkyplotOptions& options,
                                       const receiver::ReceiverOptions* receiver = nullptr);

}  // namespace canyon::drawing
