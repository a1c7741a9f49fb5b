#include "canyon/simulation/environment.hpp"

#include <algorithm>
#include <string>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/paths/propagation/propagator.hpp"

namespace canyon::simulation {

namespace {

/// Movable models farther from the antenna are not in Arrival::bodies [m].
constexpr double kNear_m = 300;

template <typename T>
std::shared_ptr<T> checked(std::shared_ptr<T> part, const char* what) {
  if (!part) throw InputError(std::string("an environment needs a ") + what);
  return part;
}

}  // namespace

CityScene::CityScene(city::City c)
    : city(std::move(c)), scene(std::shared_ptr<const city::Mesh>(std::shared_ptr<void>(), &city.mesh)) {}

CityScene::~CityScene() = default;

propagation::Propagator CityScene::propagator(const propagation::PropagationOptions& options) {
  const std::lock_guard lock(mutex_);
  const auto equal = [&](const propagation::Propagator& each) { return each.options() == options; };
  std::erase_if(propagators_, [&](const auto& each) { return !each.is_shared() && !equal(each); });
  const auto found = std::find_if(propagators_.begin(), propagators_.end(), equal);
  return found != propagators_.end() ? *found
                                     : propagators_.emplace_back(city.mesh, scene, options, city.seed);
}

propagation::Propagator Environment::make_propagator(const propagation::PropagationOptions& options) const {
  return city_scene_->propagator(options);
}

Environment::Environment(city::City city, std::shared_ptr<const orbit::Sky> sky,
                         std::map<gnss::System, gnss::Klobuchar> klobuchar)
    : Environment(std::make_shared<CityScene>(std::move(city)), std::move(sky), std::move(klobuchar)) {}

Environment::Environment(std::shared_ptr<CityScene> scene, std::shared_ptr<const orbit::Sky> sky,
                         std::map<gnss::System, gnss::Klobuchar> klobuchar)
    : city_scene_(checked(std::move(scene), "city")),
      sky_(checked(std::move(sky), "sky")),
      klobuchar_(std::move(klobuchar)),
      satellites_(sky_->satellites()) {}

void Environment::add_errors(propagation::Arrival& arrival, geodesy::GpsTime time,
                             const Eigen::Vector3d& antenna_ecef) const {
  if (!errors_) return;
  const sky::RangeErrorModel::Reception reception = errors_->reception(time, antenna_ecef);
  for (propagation::SatelliteView& view : arrival.views) view.space = errors_->at(view.line, reception);
}

propagation::Arrival Environment::arrival(geodesy::GpsTime time, const Eigen::Vector3d& antenna_enu) const {
  const geodesy::LocalFrame& frame = city().frame;
  const Eigen::Vector3d antenna_ecef = frame.ecef_from_local(antenna_enu);
  propagation::Arrival arrival = make_arrival(
      *sky_, satellites_, scene(), {time, antenna_ecef, antenna_enu, frame.ecef_from_local_rotation()});
  add_errors(arrival, time, antenna_ecef);
  return arrival;
}

propagation::Arrival Environment::arrival(geodesy::GpsTime time, const Eigen::Vector3d& antenna_enu,
                                          const propagation::Propagator& propagator) const {
  return arrival(time, antenna_enu, tracer_of(propagator));
}

propagation::Arrival Environment::arrival(geodesy::GpsTime time, const Eigen::Vector3d& antenna_enu,
                                          const Tracer& trace) const {
  propagation::Arrival all = arrival(time, antenna_enu);
  add_paths(all, trace);
  return all;
}

namespace {

/// Lifts an antenna up to 0.5 m under the terrain to 1 cm above it: simulators' vehicles sink in.
std::optional<Eigen::Vector3d> lifted_onto_terrain(const raytrace::RayScene& scene,
                                                   const Eigen::Vector3d& antenna_enu) {
  constexpr double kDeepest_m = 0.5, kClearance_m = 0.01;
  const std::optional<double> terrain_m = scene.terrain_height(antenna_enu.x(), antenna_enu.y());
  if (!terrain_m || *terrain_m - antenna_enu.z() > kDeepest_m) return std::nullopt;
  return Eigen::Vector3d(antenna_enu.x(), antenna_enu.y(), *terrain_m + kClearance_m);
}

}  // namespace

propagation::Arrival make_arrival(const orbit::Sky& sky, std::span<const gnss::SatelliteId> satellites,
                                  const raytrace::RayScene& scene, const AntennaState& standpoint) {
  propagation::Arrival arrival;
  arrival.ecef_from_enu = standpoint.ecef_from_enu;
  arrival.antenna_enu = standpoint.antenna_enu;
  arrival.containment = scene.containment(arrival.antenna_enu);
  if (arrival.containment == raytrace::Containment::UnderTerrain) {
    if (const auto lifted = lifted_onto_terrain(scene, arrival.antenna_enu)) {
      arrival.antenna_enu = *lifted;
      arrival.containment = scene.containment(arrival.antenna_enu);
    }
  }
  arrival.height_above_ground_m = scene.height_above_ground(arrival.antenna_enu);
  const orbit::Observer observer(standpoint.antenna_ecef);
  arrival.views.reserve(satellites.size());
  for (const gnss::SatelliteId id : satellites) {
    std::optional<orbit::LineOfSight> line = orbit::line_of_sight(sky, id, standpoint.time, observer);
    // The horizon is that of the antenna; rays are cast in the city's frame, whose vertical differs from the
    // antenna's by 1e-4 rad some 600 m from the origin.
    if (!line || !(line->elevation_rad > 0)) continue;
    arrival.views.push_back({*std::move(line), {}});
  }
  for (const raytrace::PosedInstance& instance : scene.posed_instances()) {
    propagation::Body body = propagation::body_of(instance);
    if ((body.centre - standpoint.antenna_enu.head<2>()).norm() < kNear_m) arrival.bodies.push_back(body);
  }
  return arrival;
}

Tracer tracer_of(const propagation::Propagator& propagator) {
  return [&propagator](const auto&... given) { propagator.trace(given...); };
}

void add_paths(propagation::Arrival& arrival, const Tracer& trace) {
  if (arrival.containment != raytrace::Containment::Free) return;
  std::vector<Eigen::Vector3d> directions;
  directions.reserve(arrival.views.size());
  for (const propagation::SatelliteView& view : arrival.views)
    directions.emplace_back(arrival.ecef_from_enu.transpose() * view.line.direction_ecef);
  std::vector<propagation::SatellitePaths> paths(directions.size());
  trace(arrival.antenna_enu, directions, paths);
  for (std::size_t i = 0; i < paths.size(); ++i) arrival.views[i].paths = std::move(paths[i]);
}

}  // namespace canyon::simulation
