#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/orbit/sky.hpp"
#include "canyon/sky/range_errors.hpp"

namespace canyon::propagation {
class Propagator;
struct PropagationOptions;
}  // namespace canyon::propagation

namespace canyon::simulation {

/// A city and the rays through it. Hosts that move objects hold one and share it between environments.
struct CityScene {
  /// The scene refers to its mesh: neither can be moved in memory.
  explicit CityScene(city::City c);
  ~CityScene();
  CityScene(const CityScene&) = delete;
  CityScene& operator=(const CityScene&) = delete;

  /// Propagators of equal options share their memory, which is large. Unused propagators are kept until the
  /// next call. Thread-safe.
  [[nodiscard]] propagation::Propagator propagator(const propagation::PropagationOptions& options);

  city::City city;
  raytrace::RayScene scene;

 private:
  std::mutex mutex_;
  std::vector<propagation::Propagator> propagators_;
};

/// Rays of a propagator or of a host: fills result[i] with the paths of the satellite in directions[i] (unit,
/// ENU) at an antenna, as Propagator::trace() does.
using Tracer =
    std::function<void(const Eigen::Vector3d& antenna_enu, std::span<const Eigen::Vector3d> directions,
                       std::span<propagation::SatellitePaths> result)>;
[[nodiscard]] Tracer tracer_of(const propagation::Propagator& propagator);

/// Antenna position for the sky and for the start of its rays.
struct AntennaState {
  geodesy::GpsTime time;
  Eigen::Vector3d antenna_ecef;   ///< lines of sight are from here [m]
  Eigen::Vector3d antenna_enu;    ///< the same position in the city's frame [m]
  Eigen::Matrix3d ecef_from_enu;  ///< rotation of the city's frame
};

/// The arrival of those `satellites` (ascending) of the sky that are above the antenna's horizon (elevation >
/// 0), without paths. For antennas up to 0.5 m under the terrain, rays start 1 cm above it
/// (Arrival::antenna_enu). Throws InputError if the antenna is not finite.
[[nodiscard]] propagation::Arrival make_arrival(const orbit::Sky& sky,
                                                std::span<const gnss::SatelliteId> satellites,
                                                const raytrace::RayScene& scene,
                                                const AntennaState& standpoint);
/// Sets the traced paths of an arrival. In buildings and under terrain all satellites are blocked, untraced.
void add_paths(propagation::Arrival& arrival, const Tracer& trace);

/// A city and a sky; either may be shared. Const and thread-safe.
class Environment {
 public:
  /// Throws InputError if either is null. Receivers use `klobuchar`, the environment does not.
  Environment(std::shared_ptr<CityScene> scene, std::shared_ptr<const orbit::Sky> sky,
              std::map<gnss::System, gnss::Klobuchar> klobuchar = {});
  /// With its own scene.
  Environment(city::City city, std::shared_ptr<const orbit::Sky> sky,
              std::map<gnss::System, gnss::Klobuchar> klobuchar = {});

  [[nodiscard]] const city::City& city() const { return city_scene_->city; }
  [[nodiscard]] const orbit::Sky& sky() const { return *sky_; }
  [[nodiscard]] const std::map<gnss::System, gnss::Klobuchar>& klobuchar() const { return klobuchar_; }
  [[nodiscard]] const raytrace::RayScene& scene() const { return city_scene_->scene; }
  /// Later arrivals have these errors (SatelliteView::space). Null (initially, and after under()): none.
  void set_errors(std::shared_ptr<const sky::RangeErrorModel> errors) { errors_ = std::move(errors); }
  [[nodiscard]] const std::shared_ptr<const sky::RangeErrorModel>& errors() const { return errors_; }
  /// Sets SatelliteView::space of an arrival of make_arrival(), if there are errors.
  void add_errors(propagation::Arrival& arrival, geodesy::GpsTime time,
                  const Eigen::Vector3d& antenna_ecef) const;
  /// The same city under another sky; nothing of the city is copied or built.
  [[nodiscard]] Environment under(std::shared_ptr<const orbit::Sky> sky,
                                  std::map<gnss::System, gnss::Klobuchar> klobuchar = {}) const {
    return {city_scene_, std::move(sky), std::move(klobuchar)};
  }

  /// A thread-safe propagator over this city; the environment must outlive it. Equal options share memory.
  [[nodiscard]] propagation::Propagator make_propagator(const propagation::PropagationOptions& options) const;

  /// make_arrival() of all satellites for an antenna in the city's ENU frame: with errors, without paths.
  [[nodiscard]] propagation::Arrival arrival(geodesy::GpsTime time, const Eigen::Vector3d& antenna_enu) const;
  /// The same with paths.
  [[nodiscard]] propagation::Arrival arrival(geodesy::GpsTime time, const Eigen::Vector3d& antenna_enu,
                                             const propagation::Propagator& propagator) const;
  [[nodiscard]] propagation::Arrival arrival(geodesy::GpsTime time, const Eigen::Vector3d& antenna_enu,
                                             const Tracer& trace) const;

 private:
  std::shared_ptr<CityScene> city_scene_;  // propagators refer to it; its address must not change
  std::shared_ptr<const orbit::Sky> sky_;
  std::map<gnss::System, gnss::Klobuchar> klobuchar_;
  std::vector<gnss::SatelliteId> satellites_;
  std::shared_ptr<const sky::RangeErrorModel> errors_;
};

}  // namespace canyon::simulation
