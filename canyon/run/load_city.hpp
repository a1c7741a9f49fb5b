#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "canyon/city/buildings/city_builder.hpp"
#include "canyon/city/fwd.hpp"
#include "canyon/run/scenario/fwd.hpp"

namespace canyon::simulation {

/// The city of a scenario, whose tileset, or folder or archive of a city model's tiles (without a box), is
/// read about the trajectory and the fixed receivers alone, if their places are known before the city. Throws
/// InputError as readers of the trajectory's file do.
[[nodiscard]] CityConfig city_config(const Scenario& scenario);
/// The same, read about a box alone. @param bbox_deg west, south, east, north [deg]
[[nodiscard]] CityConfig city_config(const Scenario& scenario, const std::array<double, 4>& bbox_deg);

/// The city as its source gives it, with the report and the map's features; facades and place are left alone.
/// Report and features are empty where the city does not come from a map.
/// Part of canyon::io. `progress` is called with features or tiles that are done and in all.
[[nodiscard]] buildings::BuiltCity read_city(
    const CityConfig& config, const std::function<void(std::size_t, std::size_t)>& progress = {});

/// The city of one run, by the scenario's seed: read about the trajectory, its facades and roofs drawn, and
/// moved as the georeference says. City::notes say what was left out and guessed of its source, "facades
/// drawn: 62 coated_glass, 38 concrete", and "city moved by east 2.1 m, north -0.4 m, turned 0.20 deg
/// (georeference)". Facades as given and a place whose standard deviations are all 0 are not touched.
[[nodiscard]] city::City load_city(const Scenario& scenario);

/// A city without a scenario. It stands where its source says: CityConfig::georeference is not applied.
[[nodiscard]] city::City load_city(const CityConfig& config, std::uint64_t seed = 1);

/// The two halves of load_city(), for many runs over one source: what is read once, and what each run draws
/// by its seed.
[[nodiscard]] city::City load_city_source(const CityConfig& config);
[[nodiscard]] city::City draw_city(city::City source, const Scenario& scenario);

}  // namespace canyon::simulation
