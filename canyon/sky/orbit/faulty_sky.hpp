#pragma once

#include <functional>
#include <memory>

#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::orbit {

/// Errors of satellites' messages.
struct MessageError {
  /// Errors of orbit [m] and rate [m/s]: radial (outwards), along (direction of flight in inertial space),
  /// cross (along the orbit's angular momentum).
  Eigen::Vector3d orbit_m = Eigen::Vector3d::Zero(), orbit_rate_mps = Eigen::Vector3d::Zero();
  double clock_s = 0, clock_drift = 0;  ///< of the clock [s, s/s]
  geodesy::GpsTime since;               ///< rates are relative to this time
  bool unhealthy = false;
};

/// The satellites affected by an error.
using SatelliteFilter = std::function<bool(gnss::SatelliteId)>;

/// The sky of faulty navigation messages. Unhealthy satellites have no state, so receivers do not use them.
class FaultySky final : public Sky {
 public:
  /// @param truth not null
  FaultySky(std::shared_ptr<const Sky> truth, SatelliteFilter concerned, const MessageError& error);

  [[nodiscard]] std::vector<gnss::SatelliteId> satellites() const override;
  [[nodiscard]] std::optional<SatelliteState> state(gnss::SatelliteId id, geodesy::GpsTime t) const override;
  [[nodiscard]] std::string source(gnss::SatelliteId id, geodesy::GpsTime t) const override;
  [[nodiscard]] SatelliteHealth health(gnss::SatelliteId id, geodesy::GpsTime t) const override;

 private:
  std::shared_ptr<const Sky> truth_;
  SatelliteFilter concerned_;
  MessageError error_;
};

/// The corresponding messages. Health and clocks exactly. Orbits to first order in their eccentricity, radial
/// and along track only (semi-major axis at the same mean motion, mean anomaly and motion): Kepler's elements
/// have no constant cross-track offset and no radial rate. GLONASS and SBAS: positions and velocities at toe,
/// all three axes. They have another issue of data, if their system has one.
[[nodiscard]] gnss::NavigationData wrong_messages(gnss::NavigationData messages,
                                                  const SatelliteFilter& concerned,
                                                  const MessageError& error);

}  // namespace canyon::orbit
