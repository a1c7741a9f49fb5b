#include "canyon/simulation/street_sources.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "canyon/city/city.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/frames.hpp"

namespace canyon::simulation {

std::optional<disturbance::StreetsOptions> streets_of(const ReceiverConfig& receiver, const city::City& city,
                                                      std::shared_ptr<const disturbance::Road> road) {
  if (!receiver.streets.enabled) return std::nullopt;
  disturbance::StreetsOptions options{receiver.streets, std::move(road), receiver.lever_arm_m.z(),
                                      receiver.options.signal.enabled};
  const std::vector<city::Object>& objects = city.mesh.objects;
  const bool green = std::any_of(objects.begin(), objects.end(), [](const city::Object& object) {
    return object.surface == city::Surface::Foliage;
  });
  if (green && !options.street.trees_per_km) options.street.trees_per_km = 0;
  return options;
}

std::vector<disturbance::Source> with_streets(const ReceiverConfig& receiver, const city::City& city,
                                              std::shared_ptr<const disturbance::Road> road) {
  std::vector<disturbance::Source> sources = receiver.disturbances;
  if (const auto streets = streets_of(receiver, city, std::move(road))) {
    sources.insert(sources.begin(), disturbance::streets_source(*streets));
  }
  return sources;
}

double closed_sky(const raytrace::RayScene& scene, std::span<const Eigen::Vector3d> antennas) {
  constexpr std::size_t kMost = 64;
  constexpr int kAzimuths = 16;
  const std::size_t step = std::max<std::size_t>(1, antennas.size() / kMost);
  std::size_t rays = 0, hidden = 0;
  for (std::size_t i = 0; i < antennas.size(); i += step) {
    if (scene.placement(antennas[i]) != raytrace::Placement::Free) continue;
    for (const double elevation_deg : {15, 30, 45, 60}) {
      for (int k = 0; k < kAzimuths; ++k) {
        ++rays;
        hidden += scene.occluded(
            {antennas[i], geodesy::enu_from_azimuth_elevation(2 * geodesy::kPi * k / kAzimuths,
                                                              geodesy::radians(elevation_deg))});
      }
    }
  }
  return rays > 0 ? static_cast<double>(hidden) / static_cast<double>(rays) : 0;
}

std::vector<Eigen::Vector3d> open_places(const raytrace::RayScene& scene, const city::City& city) {
  constexpr int kSide = 10;
  std::vector<Eigen::Vector3d> places;
  if (city.mesh.triangles.empty()) return places;
  const city::Box box = city.bounds();
  for (int i = 0; i < kSide * kSide; ++i) {
    const Eigen::Vector2d share((i % kSide + 0.5) / kSide,
                                (i / kSide + 0.5) / kSide);  // NOLINT(bugprone-integer-division)
    const Eigen::Vector2d at = box.min.head<2>() + share.cwiseProduct((box.max - box.min).head<2>());
    const double ground_m = scene.terrain_height(at.x(), at.y()).value_or(box.min.z());
    const Eigen::Vector3d place(at.x(), at.y(), ground_m + 2);
    if (scene.placement(place) == raytrace::Placement::Free) places.push_back(place);
  }
  return places;
}

receiver::ReceiverOptions with_surroundings(receiver::ReceiverOptions options,
                                            const raytrace::RayScene& scene, const city::City& city,
                                            std::span<const Eigen::Vector3d> antennas) {
  disturbance::ShadowingOptions& shadowing = options.signal.shadowing;
  if (shadowing.environment != disturbance::ShadowingEnvironment::Auto) return options;
  shadowing.environment = disturbance::of_surroundings(
      antennas.empty() ? closed_sky(scene, open_places(scene, city)) : closed_sky(scene, antennas));
  return options;
}

}  // namespace canyon::simulation
