#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::test {

/// simulation::load_city(), for tests that do not look at the warnings.
inline city::City loaded_city(const simulation::CityConfig& config, std::uint64_t seed = 1) {
  std::vector<std::string> warnings;
  return simulation::load_city(config, warnings, seed);
}

}  // namespace canyon::test
