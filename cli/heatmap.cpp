#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "canyon/analysis/heatmap/engine/engine.hpp"
#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/analysis/heatmap/engine/map_summary.hpp"
#include "canyon/analysis/heatmap/engine/mpi.hpp"
#include "canyon/analysis/heatmap/files/geotiff_writer.hpp"
#include "canyon/analysis/heatmap/files/netcdf_writer.hpp"
#include "canyon/analysis/heatmap/pictures/map_pictures.hpp"
#include "canyon/analysis/validation/comparison.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/run_checks.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/simulation/sky_builder.hpp"
#include "cli/commands.hpp"
#include "cli/field_option.hpp"
#include "cli/heatmap_request.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {
namespace {

namespace fs = std::filesystem;
using geodesy::GpsTime;

constexpr int kMaxRuns = 10'000;

std::string number(double value, int decimals) {
  return std::isnan(value) ? "-" : fmt::format("{:.{}f}", value, decimals);
}
std::string percent(double part, double whole) {
  return whole > 0 ? fmt::format("{:.1f} %", 100 * part / whole) : "-";
}

class MapRun {
 public:
  MapRun(const HeatmapArguments& arguments, heatmap::MpiProcesses& ranks)
      : arguments_(arguments), ranks_(ranks), stop_(catch_interrupts()) {}

  int run() {
    read();
    load();
    // Each run ends before the next one starts, because cities are large. The writers need the first one.
    for (int i = 0; i < runs_->count(); ++i) {
      const simulation::Scenario scenario = runs_->scenario(i);
      const simulation::ReceiverConfig receiver =
          choose_receiver(scenario, arguments_.receiver, arguments_.model);
      std::unique_ptr<simulation::Environment> environment =
          environment_of(scenario, i + 1 == runs_->count());
      heatmap::Request request = request_;
      request.samples.seed = scenario.seed;
      const auto base = simulation::base_of(scenario.receivers, receiver);
      auto heatmap = std::make_unique<heatmap::Heatmap>(*environment, receiver, request,
                                                        heatmap::input_key(*environment, request.times),
                                                        base ? &*base : nullptr);
      // The first rank creates the folder, or rejects one of another map; then the others open it.
      std::unique_ptr<heatmap::TileStore> store;
      if (ranks_.rank() == 0) store = open(tiles_of(i), *heatmap);
      ranks_.barrier();
      if (!store) store = open(tiles_of(i), *heatmap);
      const heatmap::MapRunResult result = compute(*heatmap, *store, i);
      result_.cells_computed += ranks_.sum(result.cells_computed);
      result_.resumed += result.resumed;
      result_.wall_s += result.wall_s;
      stores_.push_back(std::move(store));
      if (i == 0) {
        environment_ = std::move(environment);
        heatmap_ = std::move(heatmap);
      }
      result_.interrupted = ranks_.sum(result.interrupted ? 1 : 0) > 0;
      if (result_.interrupted) break;
    }
    // The first rank writes; the others wait for it, so that all end with one status.
    int status = result_.interrupted ? kInterrupted : kOk;
    if (ranks_.rank() == 0) status = result_.interrupted ? report_interrupt() : finish();
    return static_cast<int>(ranks_.sum(ranks_.rank() == 0 ? static_cast<std::size_t>(status) : 0));
  }

 private:
  [[nodiscard]] int finish() const {
    if (result_.resumed > 0)
      note(fmt::format("resumed     {} of {} tiles were finished", result_.resumed, tiles()));
    try {
      for (const heatmap::OverRuns over : runs_->statistics()) write(over);
    } catch (const Interrupted&) {
      return report_interrupt();
    }
    if (files_->has_others())
      print_warnings({fmt::format("{} also has files of an earlier map", arguments_.out)});
    if (!arguments_.keep_tiles) {
      for (const auto& store : stores_) store->remove();
      std::error_code ignored;  // for files of other programs in it
      fs::remove(fs::path(arguments_.out) / "tiles", ignored);
    }
    return kOk;
  }

  [[nodiscard]] fs::path tiles_of(int run) const {
    const fs::path tiles = fs::path(arguments_.out) / "tiles";
    return !runs_->several() ? tiles : tiles / fmt::format("run-{:04}", run + 1);
  }
  [[nodiscard]] fs::path folder_of(heatmap::OverRuns over) const {
    const fs::path out = arguments_.out;
    return over == runs_->statistics().front() ? out : out / fmt::format("p{:02.0f}", 100 * *over);
  }
  [[nodiscard]] std::size_t tiles() const {
    return heatmap_->unit_count() * static_cast<std::size_t>(runs_->count());
  }

  [[nodiscard]] bool quiet() const { return arguments_.quiet || ranks_.rank() > 0; }
  void note(const std::string& text) const { cli::note(quiet(), text); }

  /// Reads the arguments and the scenario. Errors that need no city are thrown here, before it is loaded.
  void read() {
    formats_ = parse_formats(arguments_.formats);
    std::vector<std::string_view> names;
    if (!arguments_.layers.empty()) names = split(arguments_.layers, ',');
    request_.layers = for_option("--layers", [&] { return heatmap::layers_named(names); });
    request_.altitude_kind = heatmap::altitude_kind_named(arguments_.altitude_kind, "--altitude-kind");
    simulation::ScenarioReadOptions options;
    options.trajectory_needed = false;
    scenario_ = simulation::read_scenario(arguments_.scenario, options);
    report_.add_line(ReadReport::Level::Guess, scenario_.warnings);
    request_.altitudes_m = arguments_.altitudes.empty()
                               ? std::vector{heatmap::usual_altitude_m(scenario_, request_.altitude_kind)}
                               : parse_altitudes(arguments_.altitudes);
    if (!scenario_.faults.empty())
      report_.add_line(ReadReport::Level::Guess, "maps have no faults: those of the scenario are ignored");
    if (arguments_.seed) scenario_.seed = *arguments_.seed;
    request_.samples = {arguments_.noise.samples, scenario_.seed};
    request_.receivers = arguments_.receivers;
    request_.limits = arguments_.limits;
    request_.motion = scenario_.map;
    if (arguments_.motion.motion != simulation::Motion::Auto)
      request_.motion.motion = arguments_.motion.motion;
    request_.times = for_option("--times", [&] {
      return heatmap::parse_times(arguments_.times, simulation::first_instant(scenario_, report_));
    });
    std::string instants = arguments_.times;
    std::replace(instants.begin(), instants.end(), '/', ',');
    for (const std::string_view piece : split(instants, ','))
      if (ranks_.rank() == 0 && piece.find(':') != std::string_view::npos) warn_of_no_zone(piece);
    receiver_ = choose_receiver(scenario_, arguments_.receiver, arguments_.model);
    if (arguments_.runs < 1 || arguments_.runs > kMaxRuns) {
      throw InputError(fmt::format("--runs {} is out of range", arguments_.runs),
                       fmt::format("give 1 to {}", kMaxRuns));
    }
    runs_.emplace(arguments_, scenario_);
    for (const std::string& prior : runs_->priors()) note(fmt::format("unknown     {}", prior));
    if (arguments_.unknowns && ranks_.rank() == 0)
      warn_of_few_samples(static_cast<std::size_t>(*arguments_.unknowns), "--unknowns");
    if (ranks_.rank() == 0) files_.emplace(arguments_.out, "heatmap", "tiles");
  }

  void load() {
    const auto begin = std::chrono::steady_clock::now();
    city_ = simulation::load_city_source(city_of_map(arguments_, scenario_));
    report_.append(city_.notes);
    const city::City& city = city_;
    simulation::check_city(scenario_, city);
    note(fmt::format("city        {}: {} triangles ({:.2f} s)", city.name, city.mesh.triangles.size(),
                     seconds_since(begin)));
    choose_area(arguments_, city, request_);
    for_option("--altitude", [&] { heatmap::check_altitudes(request_, city); });
    request_.validate();
    check_size(arguments_, request_);
    // A result must not replace an input or a user's file; check before hours of work.
    for (const heatmap::OverRuns over : runs_->statistics()) {
      std::vector<std::string> names;
      if (formats_.geotiff) names = heatmap::geotiff_names(request_);
      if (formats_.netcdf) names.emplace_back("map.nc");
      if (formats_.png) names.emplace_back("map.png");
      names.emplace_back("report.txt");
      for (const std::string& name : names) {
        ResultFiles::refuse(folder_of(over) / name);
        InputFiles::current().add_output(folder_of(over) / name);  // for files read later
      }
    }
    const std::vector<GpsTime>& times = request_.times;
    simulation::BuiltSky sky =
        simulation::build_sky(scenario_.sky, times.front(), times.back(), city.frame.origin());
    report_.append(sky.report);
    if (ranks_.rank() == 0) {
      report_.write(arguments_.out);
      print_report(report_, (fs::path(arguments_.out) / "report.txt").string());
    }
    if (receiver_.options.ionosphere || receiver_.options.fix.correct_ionosphere)
      simulation::require_ionosphere(sky);
    for_option("--times", [&] { simulation::require_satellites(*sky.sky, times); });
    sky_ = std::move(sky);
    const heatmap::Grid& grid = request_.grid;
    note(fmt::format("grid        {} x {} cells of {:g} m, {} altitude{}, {} time{} from {}", grid.columns,
                     grid.rows, grid.spacing_m, request_.altitudes_m.size(),
                     request_.altitudes_m.size() > 1 ? "s" : "", times.size(), times.size() > 1 ? "s" : "",
                     geodesy::format_utc(times.front(), 0)));
  }

  /// The city as sampled by one run, under the sky of all runs.
  [[nodiscard]] std::unique_ptr<simulation::Environment> environment_of(const simulation::Scenario& scenario,
                                                                        bool last) {
    city::City city = simulation::draw_city(last ? std::move(city_) : city::City(city_), scenario);
    return std::make_unique<simulation::Environment>(simulation::make_environment(
        std::make_shared<simulation::CityScene>(std::move(city)), sky_, scenario.sky, scenario.seed));
  }

  [[nodiscard]] std::unique_ptr<heatmap::TileStore> open(const fs::path& folder,
                                                         const heatmap::Heatmap& heatmap) const {
    return std::make_unique<heatmap::TileStore>(folder, heatmap.key(), command_of(arguments_, request_));
  }

  [[nodiscard]] heatmap::MapRunResult compute(const heatmap::Heatmap& heatmap, heatmap::TileStore& store,
                                              int run) {
    ProgressLine progress(
        runs_->several() ? fmt::format("mapping {} of {}", run + 1, runs_->count()) : std::string("mapping"),
        quiet(), "cells");
    heatmap::MapRunOptions options;
    options.threads = arguments_.threads;
    options.stop = &stop_;
    if (ranks_.ranks() > 1) {
      options.processes = ranks_.ranks();
      options.begin_queue = [this] { ranks_.begin_queue(); };
      options.next = [this] { return ranks_.next(); };
    }
    options.progress = progress.callback();
    return heatmap.run(store, options);
  }

  [[nodiscard]] int report_interrupt() const {
    std::size_t finished = 0;
    for (const auto& store : stores_)
      for (std::size_t i = 0; i < heatmap_->unit_count(); ++i) finished += store->has(i) ? 1 : 0;
    fmt::print(
        stderr,
        "canyon: interrupted: {} of {} tiles are finished and kept in {}; the same command continues from "
        "there\n",
        finished, tiles(), (fs::path(arguments_.out) / "tiles").string());
    return kInterrupted;
  }

  [[nodiscard]] heatmap::MapSource source(heatmap::OverRuns over) const {
    heatmap::MapSource source =
        heatmap::map_source(*heatmap_, *stores_.front(), *environment_, receiver_, scenario_);
    if (runs_->several()) {
      // All runs have the same units, so one map gives their indices.
      std::vector<heatmap::MapSource::Slices> slices;
      for (const auto& store : stores_) slices.push_back(heatmap::store_slices(*heatmap_, *store));
      source.slice = heatmap::slices_over_runs(std::move(slices), request_.layers, over);
      source.title += ", " + runs_->name_of(over);
      source.attributes["runs"] = std::to_string(runs_->count());
      source.attributes.erase("georeference");
      source.over_runs =
          over ? fmt::format("percentile ({:.0f}th, of layers where more is better the {:.0f}th)",
                             100 * *over, 100 - 100 * *over)
               : "mean";
    }
    source.history = command_of(arguments_, request_);
    source.source = "Canyon " CANYON_VERSION;
    source.slice = [this, slices = std::move(source.slice)](std::size_t tile, std::size_t time) {
      if (stop_.load()) throw Interrupted{};
      auto slice = slices(tile, time);
      if (!slice)
        throw InputError(fs::path(arguments_.out) / "tiles", 0, "a finished tile is missing",
                         "let no other program delete files here, and run the same command again");
      return slice;
    };
    return source;
  }

  void write(heatmap::OverRuns over) const {
    const fs::path folder = folder_of(over);
    make_output_folder(folder);
    heatmap::MapSource map = source(over);
    const auto with_progress = [&](const char* what, auto&& writer) {
      ProgressLine progress(what, quiet());
      map.progress = progress.callback();
      writer();
      map.progress = nullptr;
    };
    const heatmap::MapSummary summary = heatmap::summarize(map);
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
        for (std::string& name : heatmap::write_map_pictures(folder, map, environment_->city()))
          files.push_back(std::move(name));
      });
    }
    if (!quiet()) report(summary, folder, files, over);
  }

  void report(const heatmap::MapSummary& summary, const fs::path& folder,
              const std::vector<std::string>& files, heatmap::OverRuns over) const {
    const auto cells = static_cast<double>(summary.cells);
    const auto in = [&](heatmap::CellState state) { return static_cast<double>(summary.in_state(state)); };
    std::vector<TextRow> metrics{{"receiver", simulation::describe(heatmap_->request().motion)},
                                 {"cells (times altitudes)", short_count(cells)}};
    if (over == runs_->statistics().front()) {
      metrics.push_back({"computed now",
                         fmt::format("{} in {:.2f} s, {} cells/s",
                                     short_count(static_cast<double>(result_.cells_computed)), result_.wall_s,
                                     short_count(static_cast<double>(result_.cells_computed) /
                                                 std::max(result_.wall_s, 1e-9)))});
    }
    metrics.push_back({"inside buildings", percent(in(heatmap::CellState::InsideBuilding), cells)});
    for (const auto& [state, what] : {std::pair{heatmap::CellState::UnderTerrain, "under terrain"},
                                      std::pair{heatmap::CellState::NoTerrain, "without terrain"},
                                      std::pair{heatmap::CellState::OutsideArea, "outside the area"}})
      if (in(state) > 0) metrics.push_back({what, percent(in(state), cells)});
    if (summary.availability) metrics.push_back({"availability of a fix", percent(*summary.availability, 1)});
    fmt::print("\n");
    print_table({runs_->name_of(over), ""}, metrics);
    std::vector<TextRow> rows;
    for (const heatmap::LayerSummary& layer : summary.layers) {
      const heatmap::LayerInfo& about = heatmap::info(layer.layer);
      rows.push_back({std::string(about.name), std::string(about.unit), number(layer.least, 2),
                      number(layer.median, 2), number(layer.mean, 2), number(layer.p95, 2),
                      number(layer.greatest, 2)});
    }
    fmt::print("\n");
    print_table({"layer", "unit", "least", "median", "mean", "95 %", "greatest"}, rows);
    if (summary.values == 0)
      print_warnings({"no cell was computed: all are inside buildings, under terrain or outside the area"});
    constexpr std::size_t kListed = 12;
    std::string list;
    for (std::size_t i = 0; i < std::min(kListed, files.size()); ++i)
      list += (list.empty() ? "" : ", ") + files[i];
    if (files.size() > kListed) list += fmt::format(" and {} more", files.size() - kListed);
    note(fmt::format("\n{} file{} in {}: {}", files.size(), files.size() == 1 ? "" : "s", folder.string(),
                     list));
  }

  const HeatmapArguments& arguments_;
  ReadReport report_;  ///< of all that was read
  heatmap::MpiProcesses& ranks_;
  const std::atomic<bool>& stop_;
  std::optional<ResultFiles> files_;  ///< of the first rank
  HeatmapFormats formats_;
  heatmap::Request request_;
  simulation::Scenario scenario_;
  simulation::ReceiverConfig receiver_;
  std::optional<MapRuns> runs_;
  city::City city_;  ///< as in its source
  simulation::BuiltSky sky_;
  std::unique_ptr<simulation::Environment> environment_;  ///< of the first run, as is the map
  std::unique_ptr<heatmap::Heatmap> heatmap_;
  std::vector<std::unique_ptr<heatmap::TileStore>> stores_;  ///< of each run
  heatmap::MapRunResult result_;                             ///< of all
};

int run_heatmap(const HeatmapArguments& arguments) {
  if (arguments.scenario.empty())
    throw InputError("SCENARIO is missing", "canyon heatmap SCENARIO --out DIR");
  if (arguments.out.empty()) throw InputError("--out is missing", "give the folder for the map");
  heatmap::MpiProcesses ranks;
  return guarded(ranks, [&] { return MapRun(arguments, ranks).run(); });
}

std::string layer_list() {
  std::string text;
  for (const heatmap::LayerInfo& layer : heatmap::all_layers())
    text += fmt::format("\n  {:<27} {} [{}]", layer.name, layer.long_name, layer.unit);
  return text;
}

std::string model_list() {
  std::string text;
  for (const validation::Model& model : validation::cumulative_models({}))
    text += (text.empty() ? "" : ", ") + model.key;
  return text;
}

constexpr const char* kHeatmapFooter = R"(

Cells inside buildings are marked, not computed. DIR/tiles keeps finished tiles until the map is complete:
after Ctrl-C the same command continues from there.

Examples:
  canyon heatmap examples/synthetic_drive.yaml --out out/map --model specular
  canyon heatmap city.yaml --out out/paper --model mirror --spacing 1 --altitude 15
  canyon heatmap city.yaml --out out/day --bbox 114.170,22.298,114.176,22.304 --times day/15min
  canyon heatmap city.yaml --out out/risk --area flight.geojson --altitude 30,60,90 \
      --layers horizontal_error_p95,availability --samples 200 --format netcdf
  canyon heatmap city.yaml --out out/landing --altitude 5 --error-limit 3 --alert-limit 25 \
      --layers horizontal_error_exceedance,protected_availability
  canyon heatmap query out/risk/map.nc --path route.csv --altitude 60
  mpirun --bind-to none -n 8 canyon heatmap city.yaml --out out/large --spacing 1

docs/heatmap.md explains layers, files and clusters.)";

}  // namespace

void add_heatmap(Command& app) {
  Command& command = app.add_command("heatmap", "map position error, visibility and DOP over a city");
  HeatmapArguments& arguments = command.run_with(run_heatmap);
  command.add_option("scenario", arguments.scenario, "SCENARIO",
                     "scenario file: its city, sky and a receiver");
  command.add_option("-o,--out", arguments.out, "DIR", "folder for the map, created if missing (required)");
  command.add_option("--bbox", arguments.bbox, "W,S,E,N", "part of the city [deg] (the whole city)");
  command
      .add_option("--enu-box", arguments.enu_box, "W,S,E,N",
                  "part of the city, east and north of its origin [m]")
      .excludes("--bbox");
  command
      .add_option("--area", arguments.area, "FILE",
                  "part of the city, polygons of a GeoJSON file (longitude, latitude)")
      .excludes("--bbox")
      .excludes("--enu-box");
  add_field(command, "--spacing", arguments.grid, "spacing_m");
  command.add_option("--altitude", arguments.altitudes, "M,...",
                     "altitudes of the antenna [m] (the trajectory's height above the terrain, else 15)");
  command.add_option("--altitude-kind", arguments.altitude_kind, "KIND",
                     "above the terrain (terrain), or above the WGS 84 ellipsoid (ellipsoid) (terrain)");
  command.add_option("--times", arguments.times, "T,...",
                     "instants (UTC, or followed by ' GPST') or seconds from the scenario's start: T,T,...; "
                     "START/END/STEP; day/STEP: a sidereal day from the start. STEP in s, or 15min, 1h (the "
                     "scenario's start)");
  command.add_option("--layers", arguments.layers, "LIST",
                     "names, see below, or all but rtk_...: all "
                     "(horizontal_error,satellites_visible,hdop)");
  command.add_option("--format", arguments.formats, "LIST", "netcdf,geotiff,png or all (all)");
  command.add_option(
      "--model", arguments.model, "MODEL",
      "propagation model instead of the scenario's, a step of `canyon validate --cumulative-models`: " +
          model_list());
  command.add_option("--receiver", arguments.receiver, "NAME", "one of the scenario's receivers (the first)");
  add_field(command, "--samples", arguments.noise, "draws").formerly("--draws");
  add_field(command, "--receivers", arguments.receivers, "model");
  add_field(command, "--path-nodes", arguments.receivers, "path_nodes_m");
  add_field(command, "--motion", arguments.motion, "motion");
  add_field(command, "--error-limit", arguments.limits, "error_m");
  add_field(command, "--alert-limit", arguments.limits, "alert_m");
  add_field(command, "--protection-factor", arguments.limits, "protection_factor");
  add_field(command, "--rtk-time", arguments.limits, "rtk_s");
  command.add_option("--seed", arguments.seed, "N", "instead of the scenario's seed");
  command.add_option("--runs", arguments.runs, "N",
                     "number of maps with consecutive seeds, for which facades, the city's position and all "
                     "noise are sampled again; map is their mean, p95/map their 95 % quantile (1)");
  command
      .add_option("--unknowns", arguments.unknowns, "N",
                  "number of maps, each with a sample of what the scenario leaves open (level of the "
                  "installation, obstacles, facades, position of the city) and its own seed; map is their "
                  "median, p05, p25, p75 and p95 bound the intervals that contain 50 and 90 % of them")
      .within(2, kMaxRuns)
      .excludes("--runs");
  add_fixed_unknowns(command, arguments.known).needs("--unknowns");
  add_threads(command, arguments.threads);
  arguments.grid.tile_size = 0;
  add_field(command, "--tile", arguments.grid, "tile_size");
  command.add_flag("--keep-tiles", arguments.keep_tiles, "keep DIR/tiles when the map is complete");
  command.add_flag("--large", arguments.large,
                   "allow more than 1e10 values, or more than the free disk space");
  command.add_flag("--quiet", arguments.quiet, "print warnings and errors only");
  command.footer = "Layers:" + layer_list() + kHeatmapFooter;
  add_heatmap_query(command);
}

}  // namespace canyon::cli
