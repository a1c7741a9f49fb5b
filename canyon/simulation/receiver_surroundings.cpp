#include "canyon/simulation/receiver_surroundings.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/random.hpp"
#include "canyon/city/city.hpp"
#include "canyon/receiver/receiver_options.hpp"

namespace canyon::simulation {
namespace {

bool has_vegetation(const city::City& city) {
  const std::vector<city::Object>& objects = city.mesh.objects;
  return std::any_of(objects.begin(), objects.end(),
                     [](const city::Object& object) { return object.surface == city::Surface::Foliage; });
}

}  // namespace

std::optional<disturbance::StreetsOptions> streets_of(const ReceiverConfig& receiver, const city::City& city,
                                                      std::shared_ptr<const disturbance::Road> road) {
  if (!receiver.streets.enabled) return std::nullopt;
  disturbance::StreetsOptions options{receiver.streets, std::move(road), receiver.lever_arm_m.z(),
                                      receiver.options.signal.enabled};
  if (has_vegetation(city) && !options.street.trees_per_km) options.street.trees_per_km = 0;
  return options;
}

std::vector<disturbance::DisturbanceSource> with_streets(const ReceiverConfig& receiver,
                                                         const city::City& city,
                                                         std::shared_ptr<const disturbance::Road> road) {
  std::vector<disturbance::DisturbanceSource> sources = receiver.disturbances;
  if (const auto streets = streets_of(receiver, city, std::move(road)))
    sources.insert(sources.begin(), disturbance::streets_source(*streets));
  return sources;
}

double closed_sky(const raytrace::RayScene& scene, std::span<const Eigen::Vector3d> antennas) {
  constexpr int kAzimuths = 16;
  std::size_t rays = 0, hidden = 0;
  for (const Eigen::Vector3d& antenna : antennas) {
    if (scene.containment(antenna) != raytrace::Containment::Free) continue;
    for (const double elevation_deg : {15, 30, 45, 60}) {
      for (int k = 0; k < kAzimuths; ++k) {
        ++rays;
        hidden +=
            scene.occluded({antenna, geodesy::enu_from_azimuth_elevation(2 * geodesy::kPi * k / kAzimuths,
                                                                         geodesy::radians(elevation_deg))});
      }
    }
  }
  return rays > 0 ? static_cast<double>(hidden) / static_cast<double>(rays) : 0;
}

namespace {

/// closed_sky() of the grid of with_surroundings().
double closed_sky_of(const raytrace::RayScene& scene, const city::City& city) {
  constexpr int kSide = 10;
  std::vector<Eigen::Vector3d> points;
  const city::Box box = city.bounds();
  for (int i = 0; i < (city.mesh.triangles.empty() ? 0 : kSide * kSide); ++i) {
    const int row = i / kSide;
    const Eigen::Vector2d fraction((i % kSide + 0.5) / kSide, (row + 0.5) / kSide);
    const Eigen::Vector2d at = box.min.head<2>() + fraction.cwiseProduct((box.max - box.min).head<2>());
    points.emplace_back(at.x(), at.y(), scene.terrain_height(at.x(), at.y()).value_or(box.min.z()) + 2);
  }
  return closed_sky(scene, points);
}

}  // namespace

receiver::ReceiverOptions with_surroundings(const ReceiverConfig& receiver, const raytrace::RayScene& scene,
                                            const city::City& city, std::optional<std::uint64_t> seed) {
  receiver::ReceiverOptions options = receiver.options;
  disturbance::ShadowingOptions& shadowing = options.signal.shadowing;
  if (!shadowing.enabled || shadowing.environment != disturbance::ShadowingEnvironment::Auto) return options;
  shadowing.environment = disturbance::environment_for(closed_sky_of(scene, city));
  if (shadowing.skyline.fraction || !seed) return options;
  const auto [low, high] = disturbance::obstacle_fractions(shadowing.environment);
  shadowing.skyline.fraction = low + (high - low) * RandomStream(*seed, "surroundings").uniform();
  return options;
}

}  // namespace canyon::simulation
