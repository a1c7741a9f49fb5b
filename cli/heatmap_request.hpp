#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "canyon/analysis/heatmap/engine/map_request.hpp"
#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/unknowns/unknowns.hpp"

namespace canyon::cli {

/// Arguments of `canyon heatmap`; text if parsing needs the scenario or its city.
struct HeatmapArguments {
  std::string scenario, out;
  std::string bbox, enu_box, area;
  heatmap::Grid grid;  ///< spacing; tile_size: 0 is not given
  heatmap::MonteCarloOptions noise;
  heatmap::CellReceiverOptions receivers;
  heatmap::LimitOptions limits;
  simulation::MapOptions motion;
  std::string altitudes, altitude_kind = "terrain";
  std::string times, layers, formats = "all", model, receiver;
  std::optional<std::uint64_t> seed;
  int runs = 1;
  std::optional<int> unknowns;  ///< samples of the unknowns, instead of runs
  std::string known;            ///< unknowns that are not sampled
  int threads = 0;
  bool keep_tiles = false, large = false, quiet = false;
};

struct HeatmapFormats {
  bool netcdf = false, geotiff = false, png = false;
};

/// Larger maps (cells times altitudes, times and layers) need the option --large.
inline constexpr double kMaxValues = 1e10;

// Each throws an InputError with the option's name and a hint.

[[nodiscard]] HeatmapFormats parse_formats(const std::string& text);
/// Metres, ascending, each once.
[[nodiscard]] std::vector<double> parse_altitudes(const std::string& text);
/// The scenario's receiver of this name (empty: the first), with another propagation model if one is given.
[[nodiscard]] simulation::ReceiverConfig choose_receiver(const simulation::Scenario& scenario,
                                                         const std::string& name, const std::string& model);
/// The scenario's city. Tilesets and city models of tiles are only read near the requested box or polygon, if
/// its position is known before the city; without one, completely.
[[nodiscard]] simulation::CityConfig city_of_map(const HeatmapArguments& arguments,
                                                 const simulation::Scenario& scenario);
/// Sets grid and area: the requested box or polygon, else the whole city.
void choose_area(const HeatmapArguments& arguments, const city::City& city, heatmap::Request& request);
/// The maps to compute: by consecutive seeds (--runs), or by samples of the unknowns (--unknowns).
class MapRuns {
 public:
  MapRuns(const HeatmapArguments& arguments, const simulation::Scenario& scenario);

  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] bool several() const { return count_ > 1; }
  /// The sampled unknowns, each with its distribution.
  [[nodiscard]] std::vector<std::string> priors() const;
  /// The scenario of a run: with another seed, and with a sample of the unknowns.
  [[nodiscard]] simulation::Scenario scenario(int run) const;
  /// The maps to write; the first one is written to --out itself.
  [[nodiscard]] std::vector<heatmap::OverRuns> statistics() const;
  /// "mean of 3 runs", "median of 20 draws of unknowns", "95 % of 20 draws of unknowns".
  [[nodiscard]] std::string name_of(heatmap::OverRuns over) const;

 private:
  int count_;
  simulation::Scenario scenario_;
  std::vector<unknowns::Unknown> known_;
  std::optional<unknowns::UnknownSamples> samples_;
};
/// Number of maps to compute.
[[nodiscard]] int run_count(const HeatmapArguments& arguments);
/// Throws InputError if the map is larger than kMaxValues or than the free space at `out`, unless --large.
void check_size(const HeatmapArguments& arguments, const heatmap::Request& request);

/// The options that values depend on, in a fixed order: equal maps have equal text.
[[nodiscard]] std::string command_of(const HeatmapArguments& arguments, const heatmap::Request& request);

}  // namespace canyon::cli
