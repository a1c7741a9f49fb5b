#pragma once

#include "canyon/buildings/city_builder.hpp"

namespace canyon::buildings {

/// Counts a feature that was built from surfaces of its own.
void count_surveyed(BuildReport& report, FeatureKind kind);

/// Counts where the height, roof and facade of something built from tags are from.
void count_guesses(BuildReport& report, const Shape& shape, bool facade_known);

/// Says what is guessed of the city as a whole: most heights, heights for types of buildings that the map
/// does not have, buildings of a slope on level ground.
/// @param level the city has no terrain
void add_guesses(ReadReport& notes, const BuildReport& report, const MapData& map,
                 const HeightDefaults& heights, bool level);

}  // namespace canyon::buildings
