#pragma once

#include <cstddef>
#include <functional>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/city/buildings/city_builder.hpp"
#include "canyon/run/scenario/fwd.hpp"

// What read_city() needs GDAL and libosmium for. Part of canyon::io.
namespace canyon::simulation {

struct MapCity;

/// A city of maps and city models. `progress` is called with features that are done and in all.
[[nodiscard]] buildings::BuiltCity read_map(const MapCity& config, const CityConfig& city,
                                            const std::function<void(std::size_t, std::size_t)>& progress);

/// Height of mean sea level above the ellipsoid [m] at a place, as buildings::geoid_undulation_m() has it.
[[nodiscard]] double sea_level_m(buildings::GeoidModel model, const geodesy::Geodetic& place);

}  // namespace canyon::simulation
