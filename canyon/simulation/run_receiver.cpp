#include "canyon/simulation/run_receiver.hpp"

#include <utility>

#include "canyon/simulation/simulator.hpp"

namespace canyon::simulation {

receiver::Receiver make_receiver(const ReceiverConfig& config, std::uint64_t seed,
                                 const Environment& environment,
                                 std::shared_ptr<const disturbance::Road> road,
                                 const std::vector<disturbance::Source>& more) {
  std::vector<disturbance::Source> sources =
      config.fixed ? config.disturbances : with_streets(config, environment.city(), std::move(road));
  sources.insert(sources.end(), more.begin(), more.end());
  receiver::ReceiverOptions options = with_surroundings(config, environment.scene(), environment.city());
  decide(options, environment);
  return {std::move(options), seed, sources, config.models};
}

disturbance::FaultTimeline::Surroundings surroundings(const std::shared_ptr<CityScene>& scene,
                                                      std::shared_ptr<const orbit::Sky> sky) {
  return {std::move(sky), std::shared_ptr<const city::City>(scene, &scene->city),
          std::shared_ptr<const raytrace::RayScene>(scene, &scene->scene)};
}

}  // namespace canyon::simulation
