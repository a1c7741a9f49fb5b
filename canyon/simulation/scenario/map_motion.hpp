#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "canyon/options/visitor.hpp"

namespace canyon::simulation {

/// How a receiver moves through the cells of a heat map.
enum class Motion : std::uint8_t { Auto, Standing, Driving, Flying };

/// `map:` of a scenario.
struct MapOptions {
  Motion motion = Motion::Auto;  ///< Auto: by the receiver and the altitude (heatmap::Heatmap)
  double pace_mps = 8;           ///< of Driving and Flying [m/s], [0.1, 300]

  [[nodiscard]] bool moves() const { return motion == Motion::Driving || motion == Motion::Flying; }
};
/// Visits its fields.
void visit(options::Visitor& v, MapOptions& o);

[[nodiscard]] std::string_view name(Motion motion);
/// "standing", "driving at 8 m/s".
[[nodiscard]] std::string describe(const MapOptions& options);

}  // namespace canyon::simulation
