#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "canyon/disturbance/streets.hpp"
#include "canyon/raytrace/ray_scene.hpp"
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

/// Share of the sky from 15 to 60 deg that the city hides, the mean over antennas (ENU, m) that are not
/// inside something; 0 without any. Sixty-four rays each.
[[nodiscard]] double closed_sky(const raytrace::RayScene& scene, std::span<const Eigen::Vector3d> antennas);
/// ShadowingEnvironment::Auto of these options made definite, by closed_sky() 2 m above the ground on a grid
/// of ten by ten places over the city. All hosts call this, so that all have the same; where the antenna is
/// does not count.
[[nodiscard]] receiver::ReceiverOptions with_surroundings(receiver::ReceiverOptions options,
                                                          const raytrace::RayScene& scene,
                                                          const city::City& city);

}  // namespace canyon::simulation
