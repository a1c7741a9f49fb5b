#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/heatmap/engine/engine.hpp"
#include "canyon/simulation/scenario.hpp"

namespace canyon::cli {

/// What `canyon heatmap` is told, as text where the scenario or its city is needed to understand it.
struct HeatmapArguments {
  std::string scenario, out;
  std::string bbox, enu_box, area;
  double spacing_m = 2;
  std::string altitudes = "15", altitude_kind = "terrain";
  std::string times, layers, formats = "all", model, receiver;
  std::optional<int> draws, tile;
  std::optional<std::uint64_t> seed;
  int threads = 0;
  bool keep_tiles = false, large = false, quiet = false;
};

/// Which files to write.
struct HeatmapFormats {
  bool netcdf = false, geotiff = false, png = false;
};

/// A sidereal day, after which the satellites of GPS stand where they stood: 23 h 56 m 4 s [s].
inline constexpr double kSiderealDay_s = 86'164;
/// More values than this (cells times altitudes, times and layers) are computed only when asked for twice.
inline constexpr double kMostValues = 1e10;

// Each throws an InputError that names the option and says what to give.

[[nodiscard]] HeatmapFormats parse_formats(const std::string& text);
/// "all", or names; empty: the defaults.
[[nodiscard]] std::vector<heatmap::Layer> parse_layers(const std::string& text);
/// Metres, ascending, each once.
[[nodiscard]] std::vector<double> parse_altitudes(const std::string& text);
[[nodiscard]] heatmap::AltitudeKind parse_altitude_kind(const std::string& text);
/// "T,T,...", "START/END/STEP" (both ends) or "day/STEP" (a sidereal day from the start, its end left out); a
/// T is an instant or seconds from `start`, a STEP seconds or a number with s, min or h behind it. Ascending,
/// each once; `start` where `text` is empty. @param start empty: unknown, an InputError where it is needed
[[nodiscard]] std::vector<geodesy::GpsTime> parse_times(const std::string& text,
                                                        std::optional<geodesy::GpsTime> start);
/// The scenario's own: `start`, else that of its trajectory's file.
[[nodiscard]] std::optional<geodesy::GpsTime> scenario_start(const simulation::Scenario& scenario);
/// By the scenario's name of it (empty: the first), with another model of propagation where one is given.
[[nodiscard]] simulation::ReceiverConfig choose_receiver(const simulation::Scenario& scenario,
                                                         const std::string& name, const std::string& model);
/// Sets grid and area: the box or polygon asked for, else the whole city.
void choose_area(const HeatmapArguments& arguments, const city::City& city, heatmap::Request& request);
/// Throws where the map is larger than kMostValues or than what is free where `out` lies, unless --large.
void check_size(const HeatmapArguments& arguments, const heatmap::Request& request);
/// Throws where an altitude lies under everything that the city has.
void check_altitudes(const heatmap::Request& request, const city::City& city);

/// The options that values depend on, in a fixed order: equal maps, equal text.
[[nodiscard]] std::string command_of(const HeatmapArguments& arguments, const heatmap::Request& request);
/// Identifies what the map is computed from: the city's triangles and the sky at the request's times.
[[nodiscard]] std::string input_key(const simulation::Environment& environment,
                                    const std::vector<geodesy::GpsTime>& times);

}  // namespace canyon::cli
