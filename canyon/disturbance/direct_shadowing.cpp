#include "canyon/disturbance/direct_shadowing.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace canyon::disturbance {

DirectShadowing::DirectShadowing(const ShadowingOptions& options, std::uint64_t seed, std::string receiver)
    : options_(options), seed_(seed), receiver_(std::move(receiver)) {
  options_.validate();
}

DirectShadowing::Satellite& DirectShadowing::of(gnss::SatelliteId id) {
  const auto found = satellites_.find(id);
  if (found != satellites_.end()) return found->second;
  const std::string key = fmt::format("{}/{}/", receiver_, gnss::to_string(id));
  Satellite fresh{
      Shadowing(options_, RandomStream(seed_, key + "shadow"), RandomStream(seed_, key + "shadow level")), 0,
      std::nullopt};
  return satellites_.emplace(id, std::move(fresh)).first->second;
}

void DirectShadowing::apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) {
  if (before_) {
    way_m_ += std::hypot((antenna.position_ecef - before_->position_ecef).norm(),
                         options_.obstacle_speed_mps * (antenna.time - before_->time));
  }
  before_ = antenna;
  if (arrival.placement != raytrace::Placement::Free) return;
  for (propagation::SatelliteView& view : arrival.views) {
    if (view.paths.paths.empty()) continue;
    Satellite& satellite = of(view.line.id);
    if (satellite.swept_until) {
      satellite.swept_m +=
          options_.obstacle_distance_m * view.turning_radps() * (antenna.time - *satellite.swept_until);
    }
    satellite.swept_until = antenna.time;
    const double level_db = satellite.shadowing.level_db(way_m_ + satellite.swept_m, view.line.elevation_rad);
    for (propagation::Path& path : view.paths.paths) {
      if (path.kind == propagation::PathKind::Direct) path.amplitude_factor *= std::pow(10, level_db / 20);
    }
  }
}

}  // namespace canyon::disturbance
