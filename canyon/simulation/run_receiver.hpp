#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "canyon/disturbance/faults/fault_timeline.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/simulation/city_scene.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/street_sources.hpp"

namespace canyon::simulation {

/// The receiver that every driver of epochs makes of a configuration: its options decided by sky, errors and
/// city, behind its own disturbances, the streets that it drives along (a fixed one has none) and `more`.
/// @param road of the vehicle; null: nothing moves
[[nodiscard]] receiver::Receiver make_receiver(const ReceiverConfig& config, std::uint64_t seed,
                                               const Environment& environment,
                                               std::shared_ptr<const disturbance::Road> road,
                                               const std::vector<disturbance::Source>& more);

/// City and sky as effects of faults find them around a receiver.
[[nodiscard]] disturbance::FaultTimeline::Surroundings surroundings(const std::shared_ptr<CityScene>& scene,
                                                                    std::shared_ptr<const orbit::Sky> sky);

/// A pointer without ownership for Arrival::messages; `data` must outlive it.
[[nodiscard]] inline std::shared_ptr<const gnss::NavigationData> unowned(const gnss::NavigationData& data) {
  return {std::shared_ptr<const gnss::NavigationData>(), &data};
}

}  // namespace canyon::simulation
