#pragma once

#include <Eigen/Core>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"

namespace canyon::test {

[[nodiscard]] inline propagation::Path reflected(const Eigen::Vector3d& point) {
  propagation::Path path;
  path.kind = propagation::PathKind::Reflected;
  path.point = point;
  return path;
}

/// A manually made report with only the data used by visuals.
struct Sky {
  simulation::ReceiverRunner::Step step;
  live::ReceiverReport report;

  explicit Sky(const Eigen::Vector3d& antenna = Eigen::Vector3d::Zero()) {
    report.step = &step;
    report.antenna_world_m = antenna;
  }
  Sky(const Sky&) = delete;
  Sky& operator=(const Sky&) = delete;

  Sky& add(int prn, double azimuth_deg, double elevation_deg, propagation::Visibility visibility,
           const std::vector<Eigen::Vector3d>& reflection_points_enu = {}, bool above_mask = true) {
    const gnss::SatelliteId id{gnss::System::GPS, static_cast<std::uint8_t>(prn)};
    propagation::SatelliteView view;
    view.line.id = id;
    view.line.azimuth_rad = azimuth_deg * geodesy::radians(1);
    view.line.elevation_rad = elevation_deg * geodesy::radians(1);
    view.paths.visibility = visibility;
    if (visibility == propagation::Visibility::LOS || visibility == propagation::Visibility::LOSMultipath) {
      view.paths.paths.emplace_back();
    }
    for (const auto& point : reflection_points_enu) view.paths.paths.push_back(reflected(point));
    step.arrival.views.push_back(view);
    receiver::SatelliteObservation seen;
    seen.id = id;
    seen.above_mask = above_mask;
    seen.visibility = visibility;
    step.epoch.observed.satellites.push_back(seen);
    return *this;
  }
  Sky& fix(double east_m, double north_m, double up_m) {
    step.epoch.observed.fix.status = positioning::FixStatus::Fix;
    step.epoch.error_enu_m = {east_m, north_m, up_m};
    return *this;
  }
  Sky& clear() {
    step = {};
    return *this;
  }
};

}  // namespace canyon::test
