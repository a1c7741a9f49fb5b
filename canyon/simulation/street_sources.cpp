#include "canyon/simulation/street_sources.hpp"

#include <algorithm>
#include <utility>

#include "canyon/city/city.hpp"

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

}  // namespace canyon::simulation
