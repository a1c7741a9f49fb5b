#pragma once

#include <cstdint>
#include <memory>

#include "canyon/sky/orbit/sky.hpp"

namespace canyon::orbit {

/// A sky whose states are those of its instants 0.5 s apart, carried to the instant that is asked for by the
/// Earth's gravity: what many antennas ask of one instant, and one antenna of the epochs that follow, is
/// computed once. Within 2e-6 m and 5e-6 m/s of orbits that know J2, 4e-6 m and 3e-5 m/s of others. The
/// answers are the same for every order of questions and on every number of threads. Within 0.25 s of the end
/// of a validity an answer may be that of the other side.
class CarriedSky final : public Sky {
 public:
  /// @param sky of satellites that move by gravity; not null
  explicit CarriedSky(std::shared_ptr<const Sky> sky);

  [[nodiscard]] std::vector<gnss::SatelliteId> satellites() const override { return sky_->satellites(); }
  [[nodiscard]] std::optional<SatelliteState> state(gnss::SatelliteId id, geodesy::GpsTime t) const override;
  [[nodiscard]] std::string source(gnss::SatelliteId id, geodesy::GpsTime t) const override {
    return sky_->source(id, t);
  }

 private:
  std::shared_ptr<const Sky> sky_;
  std::uint64_t number_;  ///< no other object has it
};

}  // namespace canyon::orbit
