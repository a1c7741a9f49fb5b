#pragma once

#include <cstddef>
#include <functional>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/buildings/city_builder.hpp"
#include "canyon/simulation/scenario/fwd.hpp"

// The parts of read_city() that need GDAL and libosmium. Part of canyon::io.
namespace canyon::simulation {

struct MapCity;

/// A city of maps and city models. `progress` is called with the number of features done, and the total.
[[nodiscard]] buildings::BuiltCity read_map(const MapCity& config, const CityConfig& city,
                                            const std::function<void(std::size_t, std::size_t)>& progress);

/// Height of mean sea level above the ellipsoid [m] at a position, as buildings::geoid_undulation_m().
[[nodiscard]] double sea_level_m(buildings::GeoidModel model, const geodesy::Geodetic& position);

}  // namespace canyon::simulation
