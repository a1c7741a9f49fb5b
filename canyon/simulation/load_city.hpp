#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "canyon/buildings/city_builder.hpp"
#include "canyon/simulation/fwd.hpp"

namespace canyon::simulation {

/// What to load for a city file of any kind, by its name, or for a Gazebo model's folder. Throws InputError
/// for a name that city_file_kind() does not know, and for an origin beside a file that says its own.
/// @param origin where a mesh's zero lies, or a map's shall
[[nodiscard]] CityConfig city_config(const std::filesystem::path& file,
                                     const std::optional<geodesy::Geodetic>& origin = {});

/// The city that a scenario asks for: a map, a city file of any kind, synthetic, or open field. Part of
/// canyon::io. Where it says it stands: CityConfig::georeference is left alone.
[[nodiscard]] city::City load_city(const CityConfig& config);

/// The city of one run: load_city(), moved as the georeference and the scenario's seed say. What was done is
/// added to `warnings`, one line each: "city moved by east 2.1 m, north -0.4 m, turned 0.20 deg
/// (georeference)". Nothing is drawn nor touched where all standard deviations are 0.
[[nodiscard]] city::City load_city(const Scenario& scenario, std::vector<std::string>& warnings);

/// The same with the report and the map's features, both empty where the city comes from no map; `progress`
/// is called with features done and in all while a map is built.
[[nodiscard]] buildings::BuiltCity load_city_with_report(
    const CityConfig& config, const std::function<void(std::size_t, std::size_t)>& progress = {});

}  // namespace canyon::simulation
