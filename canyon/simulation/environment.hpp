#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/orbit/navigation_data.hpp"
#include "canyon/orbit/sky.hpp"
#include "canyon/propagation/propagator.hpp"
#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::simulation {

/// What arrives at an antenna at one instant: the answer of the pure part.
struct Arrival {
  raytrace::Placement placement = raytrace::Placement::Free;
  std::vector<propagation::SatelliteView> views;  ///< satellites above the horizon, ascending by id
};

/// City and sky: const, thread-safe, shared by every receiver and every worker.
class Environment {
 public:
  /// `sky` may be shared with others. Klobuchar coefficients ride along for receivers.
  Environment(city::City city, std::shared_ptr<const orbit::Sky> sky,
              std::map<orbit::System, orbit::Klobuchar> klobuchar = {});
  ~Environment();
  Environment(Environment&&) noexcept;

  [[nodiscard]] const city::City& city() const;
  [[nodiscard]] const orbit::Sky& sky() const;
  [[nodiscard]] const std::map<orbit::System, orbit::Klobuchar>& klobuchar() const;
  [[nodiscard]] const raytrace::RayScene& scene() const;
  /// For hosts that move things between steps; not beside queries.
  [[nodiscard]] raytrace::RayScene& mutable_scene();

  /// A propagator over this city; keep it as long as needed, it is thread-safe. The environment must outlive
  /// it.
  [[nodiscard]] propagation::Propagator make_propagator(const propagation::PropagationOptions& options) const;

  /// Everything above the horizon (elevation > 0) at a place and time. Antenna in the city's ENU frame,
  /// finite (InputError). Inside a building or under terrain nothing is traced and every satellite is
  /// blocked.
  [[nodiscard]] Arrival arrival(geodesy::GpsTime time, const Eigen::Vector3d& antenna_enu,
                                const propagation::Propagator& propagator) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::simulation
