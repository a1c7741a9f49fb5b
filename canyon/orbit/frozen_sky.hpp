#pragma once

#include "canyon/geodesy/frames.hpp"
#include "canyon/orbit/sky.hpp"

namespace canyon::orbit {

/// The paper's virtual satellites: fixed azimuths and elevations, seen from `place`, that never move over the
/// ground. They are put 20,200 km (GPS altitude) away along each direction; at `place` line_of_sight() gives
/// back azimuth and elevation within 1e-9 rad, elsewhere in a city (kilometres) within 1e-4 rad.
class FrozenSky final : public Sky {
 public:
  /// @param azimuth_rad from north, clockwise, any finite value; @param elevation_rad [0, pi/2], both of one
  /// length, 1 to 63. Satellites become G01, G02, ... in order.
  /// Throws InputError for differing lengths or values out of range (degrees given as radians are
  /// recognised).
  FrozenSky(const geodesy::Geodetic& place, const std::vector<double>& azimuth_rad,
            const std::vector<double>& elevation_rad);

  [[nodiscard]] std::vector<gnss::SatelliteId> satellites() const override;
  [[nodiscard]] std::optional<SatelliteState> state(gnss::SatelliteId id, geodesy::GpsTime t) const override;
  [[nodiscard]] std::string source(gnss::SatelliteId id, geodesy::GpsTime t) const override;

 private:
  [[nodiscard]] bool has(gnss::SatelliteId id) const;

  std::vector<Eigen::Vector3d> positions_;             ///< ECEF, at transmission
  std::vector<geodesy::AzimuthElevation> directions_;  ///< as given, azimuth wrapped
};

}  // namespace canyon::orbit
