#pragma once

#include <string_view>

#include "canyon/base/text.hpp"
#include "canyon/city/city.hpp"

namespace canyon::city {

/// Whether `word` stands in `text` as a word of its own or as one of a CamelCase name, in upper or lower
/// case: "terrain" in "City_TERRAIN.01" and "flatTerrain2", not in "subterrain". False for an empty word.
[[nodiscard]] bool has_word(std::string_view text, std::string_view word);

/// The material by words that artists and exporters use ("red_brick.003"); roof tiles count as brick, stucco
/// as plaster. Unknown where no word fits.
[[nodiscard]] Material material_from_name(std::string_view name);

}  // namespace canyon::city
