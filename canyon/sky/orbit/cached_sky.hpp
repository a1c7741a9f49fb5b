#pragma once

#include <cstdint>
#include <memory>

#include "canyon/sky/orbit/sky.hpp"

namespace canyon::orbit {

/// A sky with cached states at instants 0.5 s apart, extrapolated to the requested instant by the Earth's
/// gravity: requests of many antennas for one instant, and of one antenna for successive epochs, share one
/// computation. Within 2e-6 m and 5e-6 m/s of orbits with J2, 4e-6 m and 3e-5 m/s of others. The results do
/// not depend on the order of requests or the number of threads. Within 0.25 s of the end of a validity a
/// result may be that of the other side.
class CachedSky final : public Sky {
 public:
  /// @param sky of satellites in free orbit; not null
  explicit CachedSky(std::shared_ptr<const Sky> sky);

  [[nodiscard]] std::vector<gnss::SatelliteId> satellites() const override { return sky_->satellites(); }
  [[nodiscard]] std::optional<SatelliteState> state(gnss::SatelliteId id, geodesy::GpsTime t) const override;
  [[nodiscard]] std::string source(gnss::SatelliteId id, geodesy::GpsTime t) const override {
    return sky_->source(id, t);
  }
  [[nodiscard]] SatelliteHealth health(gnss::SatelliteId id, geodesy::GpsTime t) const override {
    return sky_->health(id, t);
  }

 private:
  std::shared_ptr<const Sky> sky_;
  std::uint64_t number_;  ///< unique to this object
};

}  // namespace canyon::orbit
