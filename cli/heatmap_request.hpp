#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "canyon/run/scenario/scenario.hpp"
#include "canyon/run/unknowns.hpp"
#include "canyon/studies/heatmap/engine/map_request.hpp"
#include "canyon/studies/heatmap/engine/map_source.hpp"

namespace canyon::cli {

/// Arguments of `canyon heatmap`; text where the scenario or its city is needed to understand them.
struct HeatmapArguments {
  std::string scenario, out;
  std::string bbox, enu_box, area;
  heatmap::Grid grid;  ///< spacing; tile_size: 0 is not given
  heatmap::DrawOptions noise;
  heatmap::CellReceiverOptions receivers;
  heatmap::LimitOptions limits;
  simulation::MapOptions motion;
  std::string altitudes, altitude_kind = "terrain";
  std::string times, layers, formats = "all", model, receiver;
  std::optional<std::uint64_t> seed;
  int runs = 1;
  std::optional<int> unknowns;  ///< draws of what the scenario leaves open, instead of runs
  std::string known;            ///< of these
  int threads = 0;
  bool keep_tiles = false, large = false, quiet = false;
};

/// Which files to write.
struct HeatmapFormats {
  bool netcdf = false, geotiff = false, png = false;
};

/// More values than this (cells times altitudes, times and layers) are computed only when asked for twice.
inline constexpr double kMostValues = 1e10;

// Each throws an InputError that names the option and says what to give.

[[nodiscard]] HeatmapFormats parse_formats(const std::string& text);
/// Metres, ascending, each once.
[[nodiscard]] std::vector<double> parse_altitudes(const std::string& text);
/// By the scenario's name of it (empty: the first), with another model of propagation where one is given.
[[nodiscard]] simulation::ReceiverConfig choose_receiver(const simulation::Scenario& scenario,
                                                         const std::string& name, const std::string& model);
/// The scenario's city. Tilesets and city models of tiles are read about the box or polygon that is asked for
/// alone, where its place is known before the city; without one, whole.
[[nodiscard]] simulation::CityConfig city_of_map(const HeatmapArguments& arguments,
                                                 const simulation::Scenario& scenario);
/// Sets grid and area: the box or polygon asked for, else the whole city.
void choose_area(const HeatmapArguments& arguments, const city::City& city, heatmap::Request& request);
/// The maps that are computed: by consecutive seeds (--runs), or by draws of what is unknown (--unknowns).
class MapRuns {
 public:
  MapRuns(const HeatmapArguments& arguments, const simulation::Scenario& scenario);

  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] bool several() const { return count_ > 1; }
  /// The unknowns that are drawn, each with its distribution.
  [[nodiscard]] std::vector<std::string> priors() const;
  /// The scenario of a run: with another seed, and with a draw of what is unknown.
  [[nodiscard]] simulation::Scenario scenario(int run) const;
  /// The maps to write, of which the first one is that of --out itself.
  [[nodiscard]] std::vector<heatmap::OverRuns> statistics() const;
  /// "mean of 3 runs", "median of 20 draws of unknowns", "95 % of 20 draws of unknowns".
  [[nodiscard]] std::string name_of(heatmap::OverRuns over) const;

 private:
  int count_;
  simulation::Scenario scenario_;
  std::vector<unknowns::Unknown> known_;
  std::optional<unknowns::Draws> draws_;
};
/// How many maps are computed.
[[nodiscard]] int run_count(const HeatmapArguments& arguments);
/// Throws where the map is larger than kMostValues or than what is free where `out` lies, unless --large.
void check_size(const HeatmapArguments& arguments, const heatmap::Request& request);

/// The options that values depend on, in a fixed order: equal maps, equal text.
[[nodiscard]] std::string command_of(const HeatmapArguments& arguments, const heatmap::Request& request);

}  // namespace canyon::cli
