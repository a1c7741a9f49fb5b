#pragma once

#include <cstddef>
#include <functional>

#include "canyon/city/buildings/city_builder.hpp"
#include "canyon/run/scenario/fwd.hpp"

namespace canyon::simulation {

/// The city as its source gives it, with the report and the map's features; facades and place are left alone.
/// Report and features are empty where the city does not come from a map.
/// Part of canyon::io. `progress` is called with features or tiles that are done and in all.
[[nodiscard]] buildings::BuiltCity read_city(
    const CityConfig& config, const std::function<void(std::size_t, std::size_t)>& progress = {});

}  // namespace canyon::simulation
