#pragma once

#include <string>
#include <vector>

#include "canyon/drawing/canvas.hpp"
#include "canyon/validation/map_judgement.hpp"

namespace canyon::validation {

/// Recorded horizontal errors along the way over the band between the map's 50 % and 95 %.
[[nodiscard]] drawing::Picture draw_map_judgement(const std::string& title,
                                                  const std::vector<MapEpoch>& epochs);

}  // namespace canyon::validation
