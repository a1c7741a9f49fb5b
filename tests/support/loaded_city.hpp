#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::test {

/// simulation::load_city() of a configuration.
inline city::City loaded_city(const simulation::CityConfig& config, std::uint64_t seed = 1) {
  return simulation::load_city(config, seed);
}

}  // namespace canyon::test
