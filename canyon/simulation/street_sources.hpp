#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "canyon/disturbance/streets.hpp"
#include "canyon/simulation/scenario.hpp"

namespace canyon::simulation {

/// What ReceiverConfig::streets makes of a city: one that has vegetation of its own gets no further trees,
/// where their number is not given. Empty: streets are not asked for.
/// @param road of the vehicle, in the city's frame; null where nothing moves
[[nodiscard]] std::optional<disturbance::StreetsOptions> streets_of(
    const ReceiverConfig& receiver, const city::City& city, std::shared_ptr<const disturbance::Road> road);

/// ReceiverConfig::disturbances, and before them streets_of().
[[nodiscard]] std::vector<disturbance::Source> with_streets(const ReceiverConfig& receiver,
                                                            const city::City& city,
                                                            std::shared_ptr<const disturbance::Road> road);

}  // namespace canyon::simulation
