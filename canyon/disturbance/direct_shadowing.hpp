#pragma once

#include <map>
#include <optional>

#include "canyon/disturbance/disturbance.hpp"
#include "canyon/disturbance/shadowing.hpp"

namespace canyon::disturbance {

/// Shadowing of every satellite's direct path along the way of one antenna; reflections and bent paths keep
/// their strength. While a satellite moves, its shadows sweep over the antenna by
/// ShadowingOptions::obstacle_distance_m times the angle, and what casts them moves too (obstacle_speed_mps).
class DirectShadowing : public Disturbance {
 public:
  /// Throws InputError where options.validate() does.
  DirectShadowing(const ShadowingOptions& options, std::uint64_t seed, std::string receiver);

  void apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) override;

 private:
  struct Satellite {
    Shadowing shadowing;
    double swept_m = 0;  // by shadows over the antenna, as the satellite moved
    std::optional<geodesy::GpsTime> swept_until;
  };
  Satellite& of(gnss::SatelliteId id);

  ShadowingOptions options_;
  std::uint64_t seed_;
  std::string receiver_;
  std::optional<propagation::Antenna> before_;
  double way_m_ = 0;
  std::map<gnss::SatelliteId, Satellite> satellites_;
};

}  // namespace canyon::disturbance
