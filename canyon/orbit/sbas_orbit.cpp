// Declared in canyon/orbit/broadcast_sky.hpp.
#include "canyon/orbit/broadcast_sky.hpp"

namespace canyon::orbit {

SatelliteState propagate(const gnss::SbasEphemeris& e, geodesy::GpsTime t) {
  const double dt = t - e.toe;
  const Eigen::Map<const Eigen::Vector3d> position(e.position_m.data()), velocity(e.velocity_mps.data()),
      acceleration(e.acceleration_mps2.data());
  SatelliteState state;
  state.position_m = position + velocity * dt + acceleration * (dt * dt / 2);
  state.velocity_mps = velocity + acceleration * dt;
  state.clock_bias_s = e.clock_bias_s + e.clock_drift * dt;
  state.clock_drift = e.clock_drift;
  state.carrier_frequency_hz = l1_frequency_hz(gnss::System::SBAS);
  return state;
}

}  // namespace canyon::orbit
