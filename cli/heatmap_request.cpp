#include "cli/heatmap_request.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <system_error>

#include "canyon/analysis/heatmap/files/area_file.hpp"
#include "canyon/analysis/validation/comparison.hpp"
#include "canyon/base/named.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "cli/city_commands.hpp"
#include "cli/commands.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {
namespace {

template <class T>
void sort_once(std::vector<T>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

heatmap::EnuBox parse_enu_box(const std::string& text) {
  const std::vector<double> values = parse_numbers(text);
  if (values.size() != 4) {
    throw InputError(fmt::format("--enu-box '{}' is not a box", text),
                     "give WEST,SOUTH,EAST,NORTH in metres of the city's frame, e.g. -200,-100,200,100");
  }
  return {{values[0], values[1]}, {values[2], values[3]}};
}

std::string bytes_text(double bytes) {
  return short_count(bytes) + (bytes >= 999.5 ? "B" : " B");
}

}  // namespace

HeatmapFormats parse_formats(const std::string& text) {
  const std::vector<std::string> known{"netcdf", "geotiff", "png", "all"};
  HeatmapFormats formats;
  for (const std::string_view piece : split(text, ',')) {
    const std::string name = lower_case(trim(piece));
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw InputError(fmt::format("--format: '{}' is unknown", name), known_names(name, known));
    formats.netcdf = formats.netcdf || name == "netcdf" || name == "all";
    formats.geotiff = formats.geotiff || name == "geotiff" || name == "all";
    formats.png = formats.png || name == "png" || name == "all";
  }
  return formats;
}

std::vector<double> parse_altitudes(const std::string& text) {
  std::vector<double> altitudes;
  for (const std::string_view piece : split(text, ',')) {
    const std::optional<double> value = parse_double(piece);
    if (!value || std::abs(*value) > 1e5) {
      throw InputError(fmt::format("--altitude '{}' is not a list of altitudes", text),
                       "give metres, e.g. 15 or 2,15,30");
    }
    altitudes.push_back(*value);
  }
  sort_once(altitudes);
  return altitudes;
}

simulation::ReceiverConfig choose_receiver(const simulation::Scenario& scenario, const std::string& name,
                                           const std::string& model) {
  const std::size_t chosen =
      for_option("--receiver", [&] { return simulation::find_receiver(scenario, name); });
  const simulation::ReceiverConfig& receiver = scenario.receivers[chosen];
  if (model.empty()) return receiver;
  return for_option("--model", [&] { return validation::models_of(receiver, {model}).front().receiver; });
}

simulation::CityConfig city_of_map(const HeatmapArguments& arguments, const simulation::Scenario& scenario) {
  if (!arguments.bbox.empty()) return simulation::city_config(scenario, parse_bbox(arguments.bbox, "--bbox"));
  if (!scenario.city.origin) return scenario.city;
  const geodesy::LocalFrame frame(*scenario.city.origin);
  if (!arguments.area.empty()) {
    const heatmap::Area area = heatmap::read_area(arguments.area, frame);
    area.validate();
    const auto [min, max] = area.bounds();
    return simulation::city_config(scenario, heatmap::degrees_around({min, max}, frame));
  }
  if (arguments.enu_box.empty()) return scenario.city;
  return simulation::city_config(scenario, heatmap::degrees_around(parse_enu_box(arguments.enu_box), frame));
}

void choose_area(const HeatmapArguments& arguments, const city::City& city, heatmap::Request& request) {
  heatmap::EnuBox box;
  std::string option;
  if (!arguments.area.empty()) {
    request.area = heatmap::read_area(arguments.area, city.frame);
    request.area->validate();
    const auto [min, max] = request.area->bounds();
    box = {min, max};
    option = "--area " + arguments.area;
  } else if (!arguments.bbox.empty()) {
    option = "--bbox";
    const std::array<double, 4> degrees = parse_bbox(arguments.bbox, option);
    box = for_option(option, [&] { return heatmap::enu_box(degrees, city.frame); });
  } else if (!arguments.enu_box.empty()) {
    box = parse_enu_box(arguments.enu_box);
    option = "--enu-box";
  } else {
    box = heatmap::built_box(city);
  }
  if (!option.empty()) for_option(option, [&] { heatmap::check_box(box, city); });
  request.grid =
      heatmap::Grid::covering(box.min.x(), box.min.y(), box.max.x(), box.max.y(), arguments.grid.spacing_m);
  std::uint32_t size = arguments.grid.tile_size;
  // Such cells are slow, tens a second, and Ctrl-C loses a tile.
  if (size == 0 && std::any_of(request.layers.begin(), request.layers.end(), heatmap::is_rtk_layer))
    size = 16;
  if (size > 0) {
    if (size > 16 && size * arguments.grid.spacing_m > heatmap::kWidestTile_m) {
      throw InputError(
          fmt::format("--tile {}: tiles of {} cells of {} m are out of range", size, size,
                      arguments.grid.spacing_m),
          fmt::format("above 16 cells, at most {:.0f} m: a tile's cells use the same satellite directions",
                      heatmap::kWidestTile_m));
    }
    request.grid.tile_size = size;
  }
}

int run_count(const HeatmapArguments& arguments) {
  return arguments.unknowns.value_or(arguments.runs);
}

MapRuns::MapRuns(const HeatmapArguments& arguments, const simulation::Scenario& scenario)
    : count_(run_count(arguments)),
      scenario_(scenario),
      known_(for_option("--fixed-unknowns", [&] { return unknowns::unknowns_of(arguments.known); })) {
  if (arguments.unknowns) samples_.emplace(scenario.seed, static_cast<std::size_t>(count_), known_);
}

std::vector<std::string> MapRuns::priors() const {
  return samples_ ? unknowns::priors_of(scenario_, known_) : std::vector<std::string>();
}

simulation::Scenario MapRuns::scenario(int run) const {
  simulation::Scenario scenario = scenario_;
  scenario.seed += static_cast<std::uint64_t>(run);
  if (samples_) samples_->apply(static_cast<std::size_t>(run), scenario);
  return scenario;
}

std::vector<heatmap::OverRuns> MapRuns::statistics() const {
  if (samples_) return {0.5, 0.05, 0.25, 0.75, 0.95};
  if (several()) return {std::nullopt, 0.95};
  return {std::nullopt};
}

std::string MapRuns::name_of(heatmap::OverRuns over) const {
  if (!several()) return "map";
  const std::string what = !over ? "mean" : *over == 0.5 ? "median" : fmt::format("{:.0f} %", 100 * *over);
  return fmt::format("{} of {} {}", what, count_, samples_ ? "draws of unknowns" : "runs");
}

void check_size(const HeatmapArguments& arguments, const heatmap::Request& request) {
  const double values = heatmap::value_count(request) * run_count(arguments);
  const std::string what =
      fmt::format("{} x {} cells, {} altitude(s), {} time(s), {} layer(s) and {} run(s) are {} values",
                  request.grid.columns, request.grid.rows, request.altitudes_m.size(), request.times.size(),
                  request.layers.size(), run_count(arguments), short_count(values));
  const char* hint =
      "use a larger --spacing, a smaller box or fewer times, or give --large to compute it anyway";
  if (arguments.large) return;
  if (values > kMaxValues) throw InputError(what, hint);
  // Finished tiles of an earlier run are part of the required space.
  namespace fs = std::filesystem;
  std::error_code ignored;
  double there = 0;
  for (fs::directory_iterator file(fs::path(arguments.out) / "tiles", ignored), end; file != end;
       file.increment(ignored)) {
    const auto size = file->file_size(ignored);
    if (!ignored) there += static_cast<double>(size);
  }
  const fs::space_info space = fs::space(arguments.out, ignored);
  const double needed = values * sizeof(float);
  if (!ignored && static_cast<double>(space.available) + there < needed) {
    throw InputError(fmt::format("{}: their tiles need {}, but {} has {} free", what, bytes_text(needed),
                                 arguments.out, bytes_text(static_cast<double>(space.available))),
                     hint);
  }
}

std::string command_of(const HeatmapArguments& arguments, const heatmap::Request& request) {
  std::string text = "canyon heatmap " + std::filesystem::path(arguments.scenario).filename().string();
  const auto add = [&text](const char* option, const std::string& value) {
    if (!value.empty()) text += fmt::format(" {} {}", option, value);
  };
  add("--bbox", arguments.bbox);
  add("--enu-box", arguments.enu_box);
  if (!arguments.area.empty()) add("--area", std::filesystem::path(arguments.area).filename().string());
  add("--spacing", fmt::format("{:g}", arguments.grid.spacing_m));
  add("--altitude", arguments.altitudes);
  add("--altitude-kind", arguments.altitude_kind);
  add("--times", arguments.times);
  std::string layers;
  for (const heatmap::Layer layer : request.layers)
    layers += fmt::format("{}{}", layers.empty() ? "" : ",", heatmap::info(layer).name);
  add("--layers", layers);
  add("--model", arguments.model);
  add("--receiver", arguments.receiver);
  if (std::any_of(request.layers.begin(), request.layers.end(),
                  [](heatmap::Layer layer) { return heatmap::info(layer).needs_samples; }))
    add("--samples", std::to_string(request.samples.samples));
  if (!(request.receivers == heatmap::CellReceiverOptions{})) {
    add("--receivers", request.receivers.model == heatmap::ReceiverModel::Run ? "run" : "steady_state");
    add("--path-nodes", fmt::format("{:g}", request.receivers.path_nodes_m));
  }
  if (arguments.motion.motion != simulation::Motion::Auto)
    add("--motion", std::string(simulation::name(arguments.motion.motion)));
  const auto has = [&request](heatmap::Layer layer) {
    return std::find(request.layers.begin(), request.layers.end(), layer) != request.layers.end();
  };
  const heatmap::LimitOptions& limits = request.limits;
  using heatmap::Layer;
  if (has(Layer::HorizontalErrorExceedance)) add("--error-limit", fmt::format("{:g}", limits.error_m));
  if (has(Layer::ProtectedAvailability)) add("--alert-limit", fmt::format("{:g}", limits.alert_m));
  if (has(Layer::ProtectionLevel) || has(Layer::ProtectedAvailability) || has(Layer::MisleadingFraction))
    add("--protection-factor", fmt::format("{:g}", limits.protection_factor));
  if (std::any_of(request.layers.begin(), request.layers.end(), heatmap::is_rtk_layer))
    add("--rtk-time", std::to_string(limits.rtk_s));
  if (arguments.runs > 1) add("--runs", std::to_string(arguments.runs));
  if (arguments.unknowns) add("--unknowns", std::to_string(*arguments.unknowns));
  add("--fixed-unknowns", arguments.known);
  add("--seed", std::to_string(request.samples.seed));
  if (arguments.grid.tile_size > 0) add("--tile", std::to_string(arguments.grid.tile_size));
  return text;
}

}  // namespace canyon::cli
