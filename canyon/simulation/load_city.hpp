#pragma once

#include "canyon/simulation/scenario.hpp"

namespace canyon::simulation {

/// The city that a scenario asks for: mesh file, synthetic, or open field. Part of canyon::io.
[[nodiscard]] city::City load_city(const CityConfig& config);

}  // namespace canyon::simulation
