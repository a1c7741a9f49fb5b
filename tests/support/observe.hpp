#pragma once

#include <map>
#include <utility>
#include <vector>

#include "canyon/receiver/receiver.hpp"

namespace canyon::test {

/// Receiver::observe() of manually made views.
inline receiver::ReceiverEpoch observe_views(receiver::Receiver& receiver, geodesy::GpsTime time,
                                             const Eigen::Vector3d& antenna_ecef,
                                             const Eigen::Vector3d& velocity_ecef,
                                             std::vector<propagation::SatelliteView> views,
                                             const Eigen::Matrix3d& ecef_from_enu,
                                             raytrace::Containment containment, const orbit::Sky& sky,
                                             const std::map<gnss::System, gnss::Klobuchar>& klobuchar = {}) {
  propagation::Arrival arrival;
  arrival.containment = containment;
  arrival.views = std::move(views);
  arrival.ecef_from_enu = ecef_from_enu;
  return receiver.observe({{time, antenna_ecef, velocity_ecef}, arrival, sky, klobuchar});
}

}  // namespace canyon::test
