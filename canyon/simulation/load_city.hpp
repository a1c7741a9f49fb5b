#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>

#include "canyon/city/buildings/city_builder.hpp"
#include "canyon/city/fwd.hpp"
#include "canyon/simulation/scenario/fwd.hpp"

namespace canyon::simulation {

/// The city configuration of a scenario. A tileset, or a folder or archive of a city model's tiles (without a
/// box), is read only near the trajectory and the fixed receivers, if their positions are known before the
/// city. Throws InputError as readers of the trajectory's file do.
[[nodiscard]] CityConfig city_config(const Scenario& scenario);
/// The same, read only near a box. @param bbox_deg west, south, east, north [deg]
[[nodiscard]] CityConfig city_config(const Scenario& scenario, const std::array<double, 4>& bbox_deg);

/// The city as its source has it, with the report and the map's features; facades and position are not
/// changed. Report and features are empty if the city does not come from a map. Part of canyon::io.
/// `progress` is called with the number of features or tiles done, and the total.
[[nodiscard]] buildings::BuiltCity read_city(
    const CityConfig& config, const std::function<void(std::size_t, std::size_t)>& progress = {});

/// The city of one run, by the scenario's seed: read near the trajectory, with sampled facades and roofs, and
/// moved as the georeference says. City::notes list what was left out of the source and assumed, "facades
/// drawn: 62 coated_glass, 38 concrete", and "city moved by east 2.1 m, north -0.4 m, turned 0.20 deg
/// (georeference)". Given facades, and a position whose standard deviations are all 0, are not changed.
[[nodiscard]] city::City load_city(const Scenario& scenario);

/// A city without a scenario, at the position of its source: CityConfig::georeference is not applied.
[[nodiscard]] city::City load_city(const CityConfig& config, std::uint64_t seed = 1);

/// The two halves of load_city() for many runs of one source: reading once, sampling by each run's seed.
[[nodiscard]] city::City load_city_source(const CityConfig& config);
[[nodiscard]] city::City draw_city(city::City source, const Scenario& scenario);

}  // namespace canyon::simulation
