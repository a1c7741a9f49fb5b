#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "canyon/city/fwd.hpp"
#include "canyon/simulation/scenario/fwd.hpp"

namespace canyon::simulation {

/// A rigid motion of a city in the horizontal plane.
struct CityShift {
  double east_m = 0;
  double north_m = 0;
  double heading_rad = 0;  ///< counter-clockwise seen from above, about the middle of the bounds
};

/// Samples a run's shift: independent zero-mean normal deviates from the stream "georeference" of `seed`.
/// Empty if all standard deviations are 0. Heading and position do not depend on each other's deviation.
[[nodiscard]] std::optional<CityShift> draw_city_shift(const Georeference& georeference, std::uint64_t seed);

/// Moves the vertices; frame and heights do not change.
void move_city(city::City& city, const CityShift& shift);

/// "city moved by east 2.1 m, north -0.4 m, turned 0.20 deg (georeference)".
[[nodiscard]] std::string describe(const CityShift& shift);

}  // namespace canyon::simulation
