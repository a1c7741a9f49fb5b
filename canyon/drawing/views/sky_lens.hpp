#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "canyon/drawing/canvas.hpp"
#include "canyon/geodesy/frames.hpp"

namespace canyon::drawing {

/// Distance of a direction from the middle, by its angle z from the zenith, as a share of the radius.
enum class SkyProjection : std::uint8_t {
  Equidistant,    ///< 2 z / pi: elevation falls evenly towards the rim
  Stereographic,  ///< tan(z / 2): angles on the sky keep their size, small shapes their form
};
/// "equidistant", "stereographic".
[[nodiscard]] std::string_view name(SkyProjection projection);

/// The upper half of the celestial sphere as a disc: zenith in the middle, horizon on the rim, north up.
struct SkyLens {
  Point centre;
  double radius = 1;  ///< of the horizon, in the units of `centre`; > 0
  SkyProjection projection = SkyProjection::Equidistant;
  /// True: as eyes or a camera see it from below, east to the left. False: as on a map, east to the right.
  bool looking_up = false;

  /// Where a direction lies. Azimuth from north, clockwise, any finite value; elevation [0, pi/2], both in
  /// rad. Below the horizon the same law goes on beyond the rim.
  [[nodiscard]] Point point(double azimuth_rad, double elevation_rad) const;
  /// Share of the radius at which an elevation lies: 0 at the zenith, 1 at the horizon.
  [[nodiscard]] double reach(double elevation_rad) const;
  /// The direction that is drawn at a point; empty outside the disc. point() of it is that point, to
  /// rounding.
  [[nodiscard]] std::optional<geodesy::AzimuthElevation> direction(const Point& at) const;
};

}  // namespace canyon::drawing
