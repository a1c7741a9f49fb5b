#include "canyon/simulation/environment.hpp"

#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/frames.hpp"

namespace canyon::simulation {

// On the heap, so that scene and mesh keep their addresses (propagators refer to them) when the environment
// moves.
struct Environment::Impl {
  Impl(city::City c, std::shared_ptr<const orbit::Sky> s, std::map<orbit::System, orbit::Klobuchar> k)
      : city(std::move(c)),
        sky(std::move(s)),
        klobuchar(std::move(k)),
        satellites(sky->satellites()),
        scene(city.mesh) {}

  city::City city;
  std::shared_ptr<const orbit::Sky> sky;
  std::map<orbit::System, orbit::Klobuchar> klobuchar;
  std::vector<orbit::SatelliteId> satellites;
  raytrace::RayScene scene;
};

namespace {

std::shared_ptr<const orbit::Sky> checked(std::shared_ptr<const orbit::Sky> sky) {
  if (!sky) throw InputError("an environment needs a sky");
  return sky;
}

}  // namespace

Environment::Environment(city::City city, std::shared_ptr<const orbit::Sky> sky,
                         std::map<orbit::System, orbit::Klobuchar> klobuchar)
    : impl_(std::make_unique<Impl>(std::move(city), checked(std::move(sky)), std::move(klobuchar))) {}
Environment::~Environment() = default;
Environment::Environment(Environment&&) noexcept = default;

const city::City& Environment::city() const {
  return impl_->city;
}
const orbit::Sky& Environment::sky() const {
  return *impl_->sky;
}
const std::map<orbit::System, orbit::Klobuchar>& Environment::klobuchar() const {
  return impl_->klobuchar;
}
const raytrace::RayScene& Environment::scene() const {
  return impl_->scene;
}
raytrace::RayScene& Environment::mutable_scene() {
  return impl_->scene;
}

propagation::Propagator Environment::make_propagator(const propagation::PropagationOptions& options) const {
  return {impl_->city.mesh, impl_->scene, options};
}

Arrival Environment::arrival(geodesy::GpsTime time, const Eigen::Vector3d& antenna_enu,
                             const propagation::Propagator& propagator) const {
  if (!antenna_enu.allFinite()) {
    throw InputError("NaN pose: the antenna's position is not finite", "give east, north and up in metres");
  }
  const geodesy::LocalFrame& frame = impl_->city.frame;
  const Eigen::Vector3d antenna_ecef = frame.ecef_from_local(antenna_enu);

  Arrival arrival;
  arrival.placement = impl_->scene.placement(antenna_enu);
  arrival.views.reserve(impl_->satellites.size());
  std::vector<Eigen::Vector3d> directions;
  directions.reserve(impl_->satellites.size());
  for (const orbit::SatelliteId id : impl_->satellites) {
    std::optional<orbit::LineOfSight> line = orbit::line_of_sight(*impl_->sky, id, time, antenna_ecef);
    // The horizon is the antenna's own; rays are cast in the city's frame, whose vertical differs from the
    // antenna's by 1e-4 rad some 600 m from the origin.
    if (!line || !(line->elevation_rad > 0)) continue;
    directions.emplace_back(frame.ecef_from_local_rotation().transpose() * line->direction_ecef);
    arrival.views.push_back({*std::move(line), {}});
  }
  if (arrival.placement != raytrace::Placement::Free) return arrival;

  std::vector<propagation::SatellitePaths> paths(directions.size());
  propagator.trace(antenna_enu, directions, paths);
  for (std::size_t i = 0; i < paths.size(); ++i) arrival.views[i].paths = std::move(paths[i]);
  return arrival;
}

}  // namespace canyon::simulation
