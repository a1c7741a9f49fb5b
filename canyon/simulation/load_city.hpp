#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "canyon/buildings/city_builder.hpp"
#include "canyon/simulation/fwd.hpp"

namespace canyon::simulation {

/// The configuration that loads a city file of any kind, or a Gazebo model's folder. Throws InputError
/// for a name that city_file_kind() does not know, and for an origin beside a file that says its own.
/// @param origin where a mesh's zero lies, or a map's shall
[[nodiscard]] CityConfig city_config(const std::filesystem::path& file,
                                     const std::optional<geodesy::Geodetic>& origin = {});

/// The city of a scenario, whose tileset, or folder or archive of a city model's tiles (without a box), is
/// read about the trajectory and the fixed receivers alone, if their places are known before the city. Throws
/// InputError as readers of the trajectory's file do.
[[nodiscard]] CityConfig city_config(const Scenario& scenario);

/// The city that a scenario asks for: a map, a city file of any kind, synthetic, or open field. Part of
/// canyon::io. It stands where its source says: CityConfig::georeference is not applied. Facades are drawn by
/// `seed` where CityConfig::facades says so; City::notes state it.
[[nodiscard]] city::City load_city(const CityConfig& config, std::uint64_t seed = 1);

/// The city of one run: load_city() by the scenario's seed, moved as the georeference and that seed say. What
/// was done is added to `warnings`, one line each: "facades drawn: 62 coated_glass, 38 concrete", "city moved
/// by east 2.1 m, north -0.4 m, turned 0.20 deg (georeference)". Facades as given and a
/// place whose standard deviations are all 0 are not touched. A map's cautions (BuildReport) come first.
[[nodiscard]] city::City load_city(const Scenario& scenario, std::vector<std::string>& warnings);

/// The two halves of load_city(), for many runs over one source: what is read once, and what each run draws
/// by its seed.
[[nodiscard]] city::City load_city_source(const CityConfig& config);
/// The same, and load_city(), with the cautions of the source (BuildReport) appended to `warnings`.
[[nodiscard]] city::City load_city_source(const CityConfig& config, std::vector<std::string>& warnings);
[[nodiscard]] city::City load_city(const CityConfig& config, std::uint64_t seed,
                                   std::vector<std::string>& warnings);
[[nodiscard]] city::City draw_city(city::City source, const Scenario& scenario,
                                   std::vector<std::string>& warnings);

/// The city as its source gives it, facades and place left alone, with the report and the map's features,
/// both empty where the city comes from no map; `progress` is called with features done and in all while a
/// map is built.
[[nodiscard]] buildings::BuiltCity load_city_with_report(
    const CityConfig& config, const std::function<void(std::size_t, std::size_t)>& progress = {});

}  // namespace canyon::simulation
