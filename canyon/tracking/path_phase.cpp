#include "canyon/tracking/path_phase.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "canyon/geodesy/constants.hpp"
#include "canyon/tracking/noise.hpp"

namespace canyon::tracking {

PathPhases::PathPhases(std::uint64_t seed, std::string_view receiver)
    : seed_(seed), prefix_(fmt::format("{}/phase/", receiver)) {}

double PathPhases::phase_rad(std::string_view satellite, std::uint64_t reflector) const {
  fmt::memory_buffer key;
  fmt::format_to(std::back_inserter(key), "{}{}/{}", prefix_, satellite, reflector);
  RandomStream stream(seed_, std::string_view(key.data(), key.size()));
  const double cycles = stream.uniform();
  // (-0.5, 0.5] cycles
  return 2 * geodesy::kPi * (cycles - std::ceil(cycles - 0.5));
}

}  // namespace canyon::tracking
