#include "canyon/analysis/heatmap/cells/receiver_realizations.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "canyon/base/random.hpp"
#include "canyon/city/city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/simulation/environment.hpp"

namespace canyon::heatmap {

using Eigen::Vector3d;

std::uint64_t seed_of(const MonteCarloOptions& monte_carlo, geodesy::GpsTime time, int draw) {
  return RandomStream(monte_carlo.seed, fmt::format("heatmap/{}/{}", time.nanoseconds(), draw)).next();
}

std::vector<sky::RangeErrorModel> range_errors_by_sample(const sky::RangeErrorModel* errors,
                                                         const MonteCarloOptions& monte_carlo,
                                                         geodesy::GpsTime time, int count,
                                                         std::span<const gnss::SatelliteId> satellites) {
  std::vector<sky::RangeErrorModel> space;
  if (errors == nullptr) return space;
  space.reserve(static_cast<std::size_t>(count));
  for (int d = 0; d < count; ++d)
    space.push_back(errors->sampled_by(seed_of(monte_carlo, time, d), satellites));
  return space;
}

ReceiverRealizations::ReceiverRealizations(const simulation::Environment& environment,
                                           const propagation::Propagator& propagator,
                                           const simulation::ReceiverConfig& receiver,
                                           const MonteCarloOptions& monte_carlo)
    : environment_(&environment),
      propagator_(&propagator),
      options_(receiver.options),
      disturbances_(receiver.disturbances),
      streets_(simulation::streets_of(receiver, environment.city(), nullptr)),
      samples_(monte_carlo) {
  options_.signal.lock.warm_start = true;
}

std::vector<disturbance::DisturbanceSource> ReceiverRealizations::disturbances_at(
    const Vector3d& point) const {
  std::vector<disturbance::DisturbanceSource> disturbances = disturbances_;
  if (streets_) {
    disturbance::StreetsOptions streets = *streets_;
    streets.above_point_m = 0;
    if (const auto terrain = environment_->scene().terrain_height(point.x(), point.y()))
      streets.street.antenna_height_m = std::clamp(point.z() - *terrain, 0.0, 1000.0);
    disturbances.insert(disturbances.begin(), disturbance::streets_source(streets));
  }
  return disturbances;
}

std::vector<std::unique_ptr<receiver::Receiver>> ReceiverRealizations::receivers_at(
    geodesy::GpsTime time, const Vector3d& point) const {
  const std::vector<disturbance::DisturbanceSource> disturbances = disturbances_at(point);
  std::vector<std::unique_ptr<receiver::Receiver>> receivers;
  receivers.reserve(static_cast<std::size_t>(samples_.samples));
  for (int d = 0; d < samples_.samples; ++d)
    receivers.push_back(std::make_unique<receiver::Receiver>(options_, seed(time, d), disturbances));
  return receivers;
}

ReceiverRealizations::Scene ReceiverRealizations::scene_at(geodesy::GpsTime now, const Vector3d& point,
                                                           const Vector3d& antenna_position_ecef) const {
  return {{now, antenna_position_ecef, Vector3d::Zero()}, environment_->arrival(now, point, *propagator_)};
}

receiver::ReceiverEpoch ReceiverRealizations::observe(receiver::Receiver& receiver, const Scene& scene,
                                                      std::span<const sky::RangeErrorModel> space,
                                                      std::size_t draw,
                                                      const rtk::Corrections* corrections) const {
  propagation::Arrival arrival = scene.arrival;  // a copy, since it is disturbed
  for (propagation::SatelliteView& view : arrival.views) view.space.reset();
  if (!space.empty()) {
    const auto reception = space[draw].reception(scene.antenna.time, scene.antenna.position_ecef);
    for (propagation::SatelliteView& view : arrival.views) view.space = space[draw].at(view.line, reception);
  }
  return receiver.observe(
      {scene.antenna, arrival, environment_->sky(), environment_->klobuchar(), corrections});
}

}  // namespace canyon::heatmap
