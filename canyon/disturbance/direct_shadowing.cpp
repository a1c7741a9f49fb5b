#include "canyon/disturbance/direct_shadowing.hpp"

#include <cmath>

#include "canyon/geodesy/frames.hpp"

namespace canyon::disturbance {

DirectShadowing::DirectShadowing(const ShadowingOptions& options, std::uint64_t seed,
                                 const std::string& receiver)
    : obstacle_speed_mps_(options.obstacle_speed_mps),
      shadowing_(options, seed, receiver),
      skyline_(options, seed) {}

void DirectShadowing::apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) {
  if (before_) {
    way_m_ += std::hypot((antenna.position_ecef - before_->position_ecef).norm(),
                         obstacle_speed_mps_ * (antenna.time - before_->time));
  }
  before_ = antenna;
  shadowing_.go_to(way_m_, arrival.height_above_ground_m);
  if (arrival.placement != raytrace::Placement::Free) return;
  skyline_.go_to(arrival.antenna_enu.head<2>(), arrival.height_above_ground_m, antenna.time);
  for (propagation::SatelliteView& view : arrival.views) {
    for (propagation::Path& path : view.paths.paths) {
      const bool from_surface =
          path.kind != propagation::PathKind::Direct && path.kind != propagation::PathKind::Transmitted;
      double level_db = from_surface
                            ? skyline_.level_db(path.arrival, (path.point - arrival.antenna_enu).norm())
                            : skyline_.level_db(path.arrival);
      if (path.kind == propagation::PathKind::Direct) {
        level_db +=
            shadowing_.of(geodesy::enu_from_azimuth_elevation(view.line.azimuth_rad, view.line.elevation_rad))
                .level_db;
      }
      if (level_db != 0) path.amplitude_factor *= std::pow(10, level_db / 20);
    }
  }
}

}  // namespace canyon::disturbance
