#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/paths/disturbance/streets.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::simulation {

/// The streets of ReceiverConfig::streets in a city. A city with its own vegetation gets no further trees
/// unless their number is given. Empty: streets are off. @param road of the vehicle, in the city's frame;
/// null if nothing moves
[[nodiscard]] std::optional<disturbance::StreetsOptions> streets_of(
    const ReceiverConfig& receiver, const city::City& city, std::shared_ptr<const disturbance::Road> road);

/// Disturbances of a receiver: streets_of(), then ReceiverConfig::disturbances.
[[nodiscard]] std::vector<disturbance::DisturbanceSource> with_streets(
    const ReceiverConfig& receiver, const city::City& city, std::shared_ptr<const disturbance::Road> road);

/// Fraction of the sky from 15 to 60 deg that the city hides, the mean over antennas (ENU, m) that are in
/// free space; 0 if there are none. Sixty-four rays each.
[[nodiscard]] double closed_sky(const raytrace::RayScene& scene, std::span<const Eigen::Vector3d> antennas);
/// Options of a receiver with resolved surroundings: ShadowingEnvironment::Auto is decided by closed_sky() 2
/// m above the ground on a grid of ten by ten points over the city, independent of the antenna's position.
/// @param seed if SkylineOptions::share is empty, seed of its sample (disturbance::obstacle_fractions()), one
/// for all receivers; empty: the middle value
[[nodiscard]] receiver::ReceiverOptions with_surroundings(const ReceiverConfig& receiver,
                                                          const raytrace::RayScene& scene,
                                                          const city::City& city,
                                                          std::optional<std::uint64_t> seed);

}  // namespace canyon::simulation
