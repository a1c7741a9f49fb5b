#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/gnss/navigation_data.hpp"
#include "canyon/orbit/sky.hpp"
#include "canyon/propagation/propagator.hpp"
#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::simulation {

/// What arrives at an antenna at one instant: the answer of the pure part.
struct Arrival {
  raytrace::Placement placement = raytrace::Placement::Free;
  std::vector<propagation::SatelliteView> views;  ///< satellites above the horizon, ascending by id
};

/// A city and the rays through it. Hosts that move things hold one and share it between environments.
struct CityScene {
  explicit CityScene(city::City c) : city(std::move(c)), scene(city.mesh) {}
  CityScene(const CityScene&) = delete;
  CityScene& operator=(const CityScene&) = delete;

  city::City city;
  raytrace::RayScene scene;
};

/// Fills result[i] with the paths of the satellite in directions[i] (unit, ENU) at an antenna: what
/// Propagator::trace() does, or a host with rays of its own.
using Tracer =
    std::function<void(const Eigen::Vector3d& antenna_enu, std::span<const Eigen::Vector3d> directions,
                       std::span<propagation::SatellitePaths> result)>;

/// City and sky: const, thread-safe, shared by every receiver and every worker.
class Environment {
 public:
  /// Over a scene that others may hold as well; neither may be null (InputError).
  Environment(std::shared_ptr<CityScene> scene, std::shared_ptr<const orbit::Sky> sky,
              std::map<gnss::System, gnss::Klobuchar> klobuchar = {});
  /// `sky` may be shared with others. Klobuchar coefficients ride along for receivers.
  Environment(city::City city, std::shared_ptr<const orbit::Sky> sky,
              std::map<gnss::System, gnss::Klobuchar> klobuchar = {});
  ~Environment();
  Environment(Environment&&) noexcept;

  [[nodiscard]] const city::City& city() const;
  [[nodiscard]] const orbit::Sky& sky() const;
  [[nodiscard]] const std::map<gnss::System, gnss::Klobuchar>& klobuchar() const;
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
  /// The same with other rays; `trace` is called once, unless the placement is not Free.
  [[nodiscard]] Arrival arrival(geodesy::GpsTime time, const Eigen::Vector3d& antenna_enu,
                                const Tracer& trace) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::simulation
