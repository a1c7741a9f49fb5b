#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/heatmap/engine/engine.hpp"
#include "canyon/heatmap/engine/map_source.hpp"
#include "canyon/heatmap/engine/map_summary.hpp"
#include "canyon/heatmap/engine/store_slices.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/validation/models.hpp"
#include "cli/commands.hpp"
#include "cli/field_option.hpp"
#include "cli/heatmap_commands.hpp"
#include "cli/heatmap_request.hpp"
#include "cli/interrupt.hpp"
#include "cli/progress.hpp"
#include "cli/ranks.hpp"

namespace canyon::cli {
namespace {

namespace fs = std::filesystem;
using geodesy::GpsTime;

/// Ctrl-C while files are written: thrown through the writers.
struct Interrupted {};

std::string number(double value, int decimals) {
  return std::isnan(value) ? "-" : fmt::format("{:.{}f}", value, decimals);
}
std::string percent(double part, double whole) {
  return whole > 0 ? fmt::format("{:.1f} %", 100 * part / whole) : "-";
}

class Command {
 public:
  Command(const HeatmapArguments& arguments, const Ranks& ranks)
      : arguments_(arguments), ranks_(ranks), stop_(catch_interrupts()) {}

  int run() {
    read();
    load();
    const heatmap::Heatmap heatmap(*environment_, receiver_, request_,
                                   heatmap::input_key(*environment_, request_.times));
    const fs::path tiles = fs::path(arguments_.out) / "tiles";
    // The first rank makes the folder, or refuses one of another map; then the others find it.
    std::unique_ptr<heatmap::TileStore> store;
    if (ranks_.rank() == 0) store = open(tiles, heatmap);
    ranks_.barrier();
    if (!store) store = open(tiles, heatmap);
    compute(heatmap, *store);
    const bool interrupted = ranks_.sum(result_.interrupted ? 1 : 0) > 0;
    result_.cells_computed = ranks_.sum(result_.cells_computed);
    result_.resumed = ranks_.sum(result_.resumed);
    // The first one writes; the others wait for it, so that all end with one status.
    int status = interrupted ? kInterrupted : kOk;
    if (ranks_.rank() == 0)
      status = interrupted ? tell_interrupted(heatmap, *store) : finish(heatmap, *store);
    return static_cast<int>(ranks_.sum(ranks_.rank() == 0 ? static_cast<std::size_t>(status) : 0));
  }

 private:
  int finish(const heatmap::Heatmap& heatmap, heatmap::TileStore& store) const {
    if (result_.resumed > 0) {
      note(fmt::format("resumed     {} of {} tiles were there", result_.resumed, heatmap.unit_count()));
    }
    try {
      write(heatmap, store);
    } catch (const Interrupted&) {
      return tell_interrupted(heatmap, store);
    }
    if (!arguments_.keep_tiles) store.remove();
    return kOk;
  }

  [[nodiscard]] bool quiet() const { return arguments_.quiet || ranks_.rank() > 0; }
  void note(const std::string& text) const {
    if (quiet()) return;
    std::fflush(stdout);  // what was printed before it stands before it in a log, too
    fmt::print(stderr, "{}\n", text);
  }
  void warn(const std::vector<std::string>& lines) const {
    if (ranks_.rank() == 0) print_warnings(lines);
  }

  /// Reads the arguments and the scenario. Errors that need no city come from here, before it is loaded.
  void read() {
    formats_ = parse_formats(arguments_.formats);
    request_.layers = parse_layers(arguments_.layers);
    request_.altitudes_m = parse_altitudes(arguments_.altitudes);
    request_.altitude_kind = parse_altitude_kind(arguments_.altitude_kind);
    simulation::ScenarioReadOptions options;
    options.trajectory_needed = false;
    scenario_ = simulation::read_scenario(arguments_.scenario, options);
    warn(scenario_.warnings);
    if (!scenario_.faults.empty())
      warn({"a map is of a place and has no faults: those of the scenario are left out"});
    if (arguments_.seed) scenario_.seed = *arguments_.seed;
    request_.draws = {arguments_.noise.draws, scenario_.seed};
    request_.receivers = arguments_.receivers;
    request_.times = for_option(
        "--times", [&] { return heatmap::parse_times(arguments_.times, scenario_start(scenario_)); });
    std::string instants = arguments_.times;
    std::replace(instants.begin(), instants.end(), '/', ',');
    for (const std::string_view piece : split(instants, ',')) {
      if (ranks_.rank() == 0 && piece.find(':') != std::string_view::npos) warn_of_no_zone(piece);
    }
    receiver_ = choose_receiver(scenario_, arguments_.receiver, arguments_.model);
    make_output_folder(arguments_.out);
  }

  void load() {
    const auto begin = std::chrono::steady_clock::now();
    std::vector<std::string> warnings;
    city::City city = simulation::load_city(scenario_, warnings);
    warn(warnings);
    if (!scenario_.city.open && city.mesh.triangles.empty()) {
      throw InputError(scenario_.file, 0,
                       fmt::format("the city '{}' is empty: it has no triangle", city.name),
                       "give another mesh, or city: {open: true} for an open field");
    }
    note(fmt::format("city        {}: {} triangles ({:.2f} s)", city.name, city.mesh.triangles.size(),
                     seconds_since(begin)));
    choose_area(arguments_, city, request_);
    for_option("--altitude", [&] { heatmap::check_altitudes(request_, city); });
    request_.validate();
    check_size(arguments_, request_);
    const std::vector<GpsTime>& times = request_.times;
    simulation::BuiltSky sky =
        simulation::build_sky(scenario_.sky, times.front(), times.back(), city.frame.origin());
    warn(sky.warnings);
    if (receiver_.options.ionosphere || receiver_.options.fix.correct_ionosphere) {
      simulation::require_ionosphere(sky);
    }
    check_times(*sky.sky);
    environment_ =
        std::make_unique<simulation::Environment>(std::move(city), sky.sky, sky.navigation.klobuchar);
    const heatmap::Grid& grid = request_.grid;
    note(fmt::format("grid        {} x {} cells of {:g} m, {} altitude{}, {} time{} from {}", grid.columns,
                     grid.rows, grid.spacing_m, request_.altitudes_m.size(),
                     request_.altitudes_m.size() > 1 ? "s" : "", times.size(), times.size() > 1 ? "s" : "",
                     geodesy::format_utc(times.front(), 0)));
  }

  void check_times(const orbit::Sky& sky) const {
    for (const GpsTime t : request_.times) {
      if (simulation::has_satellites(sky, t)) continue;
      throw InputError(
          fmt::format("--times: no satellite has an ephemeris at {}", geodesy::format_utc(t, 0)),
          "give times near those that the scenario's ephemerides are of, or ephemerides of that day");
    }
  }

  [[nodiscard]] std::unique_ptr<heatmap::TileStore> open(const fs::path& folder,
                                                         const heatmap::Heatmap& heatmap) const {
    return std::make_unique<heatmap::TileStore>(folder, heatmap.key(), command_of(arguments_, request_));
  }

  void compute(const heatmap::Heatmap& heatmap, heatmap::TileStore& store) {
    Progress progress("mapping", quiet(), "cells");
    heatmap::RunOptions options;
    options.threads = arguments_.threads;
    options.stop = &stop_;
    options.rank = ranks_.rank();
    options.ranks = ranks_.size();
    options.progress = progress.callback();
    result_ = heatmap.run(store, options);
  }

  int tell_interrupted(const heatmap::Heatmap& heatmap, const heatmap::TileStore& store) const {
    std::size_t finished = 0;
    for (std::size_t i = 0; i < heatmap.unit_count(); ++i) finished += store.has(i) ? 1 : 0;
    fmt::print(
        stderr,
        "canyon: interrupted: {} of {} tiles are finished and kept in {}; the same command goes on from "
        "there\n",
        finished, heatmap.unit_count(), (fs::path(arguments_.out) / "tiles").string());
    return kInterrupted;
  }

  [[nodiscard]] heatmap::MapSource source(const heatmap::Heatmap& heatmap,
                                          const heatmap::TileStore& store) const {
    heatmap::MapSource source = heatmap::map_source(heatmap, store, *environment_, receiver_, scenario_);
    source.history = command_of(arguments_, request_);
    source.source = "Canyon " CANYON_VERSION;
    source.slice = [this, slices = std::move(source.slice)](std::size_t tile, std::size_t time) {
      if (stop_.load()) throw Interrupted{};
      return slices(tile, time);
    };
    return source;
  }

  void write(const heatmap::Heatmap& heatmap, const heatmap::TileStore& store) const {
    heatmap::MapSource map = source(heatmap, store);
    const auto with_progress = [&](const char* what, auto&& writer) {
      Progress progress(what, quiet());
      map.progress = progress.callback();
      writer();
      map.progress = nullptr;
    };
    const heatmap::MapSummary summary = heatmap::summarize(map);
    const fs::path folder = arguments_.out;
    std::vector<std::string> files;
    if (formats_.netcdf) {
      with_progress("writing NetCDF", [&] { heatmap::write_netcdf(folder / "map.nc", map); });
      files.emplace_back("map.nc");
    }
    if (formats_.geotiff) {
      with_progress("writing GeoTIFF", [&] {
        for (std::string& name : heatmap::write_geotiffs(folder, map)) files.push_back(std::move(name));
      });
    }
    if (formats_.png) {
      with_progress("drawing", [&] {
        for (std::string& name : heatmap::write_map_pictures(folder, map, environment_->city())) {
          files.push_back(std::move(name));
        }
      });
    }
    if (!quiet()) tell(summary, files);
  }

  void tell(const heatmap::MapSummary& summary, const std::vector<std::string>& files) const {
    const auto cells = static_cast<double>(summary.cells);
    const auto in = [&](heatmap::CellState state) { return static_cast<double>(summary.in_state(state)); };
    std::vector<std::vector<std::string>> figures{
        {"cells (times altitudes)", short_count(cells)},
        {"computed now", fmt::format("{} in {:.2f} s, {} cells/s",
                                     short_count(static_cast<double>(result_.cells_computed)), result_.wall_s,
                                     short_count(static_cast<double>(result_.cells_computed) /
                                                 std::max(result_.wall_s, 1e-9)))},
        {"inside buildings", percent(in(heatmap::CellState::InsideBuilding), cells)}};
    for (const auto& [state, what] : {std::pair{heatmap::CellState::UnderTerrain, "under terrain"},
                                      std::pair{heatmap::CellState::NoTerrain, "without terrain"},
                                      std::pair{heatmap::CellState::OutsideArea, "outside the area"}}) {
      if (in(state) > 0) figures.push_back({what, percent(in(state), cells)});
    }
    if (summary.availability) figures.push_back({"availability of a fix", percent(*summary.availability, 1)});
    fmt::print("\n");
    print_table({"map", ""}, figures);
    std::vector<std::vector<std::string>> rows;
    for (const heatmap::LayerSummary& layer : summary.layers) {
      const heatmap::LayerInfo& about = heatmap::info(layer.layer);
      rows.push_back({std::string(about.name), std::string(about.unit), number(layer.least, 2),
                      number(layer.median, 2), number(layer.mean, 2), number(layer.p95, 2),
                      number(layer.greatest, 2)});
    }
    fmt::print("\n");
    print_table({"layer", "unit", "least", "median", "mean", "95 %", "greatest"}, rows);
    if (summary.values == 0) {
      print_warnings({"no cell was computed: all lie inside buildings, under terrain or outside the area"});
    }
    constexpr std::size_t kListed = 12;
    std::string list;
    for (std::size_t i = 0; i < std::min(kListed, files.size()); ++i) {
      list += (list.empty() ? "" : ", ") + files[i];
    }
    if (files.size() > kListed) list += fmt::format(" and {} more", files.size() - kListed);
    note(fmt::format("\n{} file{} in {}: {}", files.size(), files.size() == 1 ? "" : "s", arguments_.out,
                     list));
  }

  const HeatmapArguments& arguments_;
  const Ranks& ranks_;
  const std::atomic<bool>& stop_;
  HeatmapFormats formats_;
  heatmap::Request request_;
  simulation::Scenario scenario_;
  simulation::ReceiverConfig receiver_;
  std::unique_ptr<simulation::Environment> environment_;
  heatmap::RunResult result_;
};

int run(const HeatmapArguments& arguments) {
  if (arguments.scenario.empty())
    throw InputError("SCENARIO is missing", "canyon heatmap SCENARIO --out DIR");
  if (arguments.out.empty()) throw InputError("--out is missing", "say which folder the map shall stand in");
  const Ranks ranks;
  return ranks.guard([&] { return Command(arguments, ranks).run(); });
}

std::string layer_list() {
  std::string text;
  for (const heatmap::LayerInfo& layer : heatmap::all_layers()) {
    text += fmt::format("\n  {:<22} {} [{}]", layer.name, layer.long_name, layer.unit);
  }
  return text;
}

std::string model_list() {
  std::string text;
  for (const validation::Model& model : validation::model_ladder({})) {
    text += (text.empty() ? "" : ", ") + model.key;
  }
  return text;
}

constexpr const char* kFooter = R"(

Cells inside buildings are marked, not computed. Finished tiles stand in DIR/tiles until the map is
whole: Ctrl-C keeps them, and the same command goes on from there.

Examples:
  canyon heatmap examples/synthetic_drive.yaml --out out/map --model specular
  canyon heatmap city.yaml --out out/paper --model mirror --spacing 1 --altitude 15
  canyon heatmap city.yaml --out out/day --bbox 114.170,22.298,114.176,22.304 --times day/15min
  canyon heatmap city.yaml --out out/risk --area flight.geojson --altitude 30,60,90 \
      --layers horizontal_error_p95,availability --draws 200 --format netcdf
  canyon heatmap query out/risk/map.nc --path route.csv --altitude 60
  mpirun -n 8 canyon heatmap city.yaml --out out/large --spacing 1   (a build with CANYON_BUILD_MPI)

docs/heatmap.md explains layers and files, docs/scaling.md clusters.)";

}  // namespace

void add_heatmap(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<HeatmapArguments>();
  CLI::App* command = app.add_subcommand("heatmap", "maps of position error, visibility and DOP over a city");
  command->require_subcommand(0, 1);
  command->add_option("scenario", arguments->scenario, "scenario file: its city, sky and a receiver")
      ->type_name("SCENARIO");
  command->add_option("-o,--out", arguments->out, "folder for the map, made where needed (required)")
      ->type_name("DIR");
  CLI::Option* bbox =
      command->add_option("--bbox", arguments->bbox, "part of the city [deg] (the whole city)");
  bbox->type_name("W,S,E,N");
  CLI::Option* enu =
      command->add_option("--enu-box", arguments->enu_box, "likewise, east and north of its origin [m]");
  enu->type_name("W,S,E,N")->excludes(bbox);
  command->add_option("--area", arguments->area, "likewise, polygons of a GeoJSON file (longitude, latitude)")
      ->type_name("FILE")
      ->excludes(bbox)
      ->excludes(enu);
  add_field(*command, "--spacing", arguments->grid, "spacing_m");
  command->add_option("--altitude", arguments->altitudes, "altitudes of the antenna [m] (15)")
      ->type_name("M,...");
  command
      ->add_option("--altitude-kind", arguments->altitude_kind,
                   "above the terrain (terrain), or above the WGS 84 ellipsoid (ellipsoid) (terrain)")
      ->type_name("KIND");
  command
      ->add_option("--times", arguments->times,
                   "instants (UTC, or with ' GPST' behind) or seconds from the scenario's start: T,T,...; "
                   "START/END/STEP; day/STEP: a sidereal day from the start. STEP in s, or 15min, 1h "
                   "(the scenario's start)")
      ->type_name("T,...");
  command
      ->add_option("--layers", arguments->layers,
                   "names, see below, or all (horizontal_error,satellites_visible,hdop)")
      ->type_name("LIST");
  command->add_option("--format", arguments->formats, "netcdf,geotiff,png or all (all)")->type_name("LIST");
  command
      ->add_option("--model", arguments->model,
                   "instead of the scenario's propagation, one of the steps of `canyon validate --ladder`: " +
                       model_list())
      ->type_name("MODEL");
  command->add_option("--receiver", arguments->receiver, "which of the scenario's (the first)")
      ->type_name("NAME");
  add_field(*command, "--draws", arguments->noise, "draws");
  add_field(*command, "--receivers", arguments->receivers, "model");
  add_field(*command, "--path-nodes", arguments->receivers, "path_nodes_m");
  command->add_option("--seed", arguments->seed, "instead of the scenario's seed")->type_name("N");
  add_threads(*command, arguments->threads);
  arguments->grid.tile_size = 0;
  add_field(*command, "--tile", arguments->grid, "tile_size");
  command->add_flag("--keep-tiles", arguments->keep_tiles, "leave DIR/tiles when the map is whole");
  command->add_flag("--large", arguments->large,
                    "more than 1e10 values, or more than the disk seems to hold");
  command->add_flag("--quiet", arguments->quiet, "print warnings and errors only");
  command->footer("Layers:" + layer_list() + kFooter);
  const CLI::App* query = add_heatmap_query(*command, action);
  command->callback([arguments, query, &action] {
    if (!query->parsed()) action = [arguments] { return run(*arguments); };
  });
}

}  // namespace canyon::cli
