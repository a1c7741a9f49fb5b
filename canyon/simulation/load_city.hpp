#pragma once

#include <cstddef>
#include <functional>

#include "canyon/buildings/city_builder.hpp"
#include "canyon/simulation/scenario.hpp"

namespace canyon::simulation {

/// The city that a scenario asks for: a map, a city file of any kind, synthetic, or open field. Part of
/// canyon::io.
[[nodiscard]] city::City load_city(const CityConfig& config);

/// The same with the report and the map's features, both empty where the city comes from no map; `progress`
/// is called with features done and in all while a map is built.
[[nodiscard]] buildings::BuiltCity load_city_with_report(
    const CityConfig& config, const std::function<void(std::size_t, std::size_t)>& progress = {});

}  // namespace canyon::simulation
