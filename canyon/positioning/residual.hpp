#pragma once

#include <optional>

#include "canyon/positioning/fix.hpp"

namespace canyon::positioning {

/// The residual of a satellite in a fix, measured minus computed [m]; empty where the satellite is not used.
[[nodiscard]] std::optional<double> residual_m(const Fix& fix, gnss::SatelliteId id);

}  // namespace canyon::positioning
