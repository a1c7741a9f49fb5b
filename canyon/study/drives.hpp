#pragma once

#include "canyon/simulation/city_scene.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/study/axis.hpp"

namespace canyon::study {

/// A drive drawn at random through the free places of a city: the same for the same city, options, seed and
/// number. It begins anywhere outside buildings, in the middle 80 % of the city's bounds; each leg goes the
/// longest of a few drawn ways on which no ray meets anything at the antenna's height, turns back only where
/// nothing else is free, and keeps 3 m from what ends it. Throws InputError where no drive is found.
[[nodiscard]] simulation::TrajectoryConfig random_drive(const simulation::CityScene& scene,
                                                        const DriveOptions& options, std::uint64_t seed,
                                                        const std::string& number);

}  // namespace canyon::study
