#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <system_error>
#include <thread>

#include "canyon/analysis/bench/tracks.hpp"
#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/analysis/heatmap/files/stored_map.hpp"
#include "canyon/analysis/heatmap/pictures/map_view.hpp"
#include "canyon/analysis/validation/comparison_view.hpp"
#include "canyon/base/file_kind.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/outputs/view/header.hpp"
#include "canyon/outputs/view/page.hpp"
#include "canyon/outputs/view/probe.hpp"
#include "canyon/outputs/view/view_sink.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "cli/city_commands.hpp"
#include "cli/commands.hpp"
#include "cli/progress.hpp"
#include "cli/scenario_run.hpp"
#include "cli/view_record.hpp"
#include "cli/view_serve.hpp"

namespace canyon::cli {
namespace {

struct ViewArguments {
  std::string input;
  std::string exported;
  std::string out;
  std::string map, city;
  std::vector<std::string> live;
  RecordArguments record;
  RunArguments run;
  std::size_t paths = view::ViewOptions{}.paths_per_satellite;
  std::vector<std::string> tracks;
  ServeOptions serve;
};

/// A folder for the view: the user's, or a temporary one.
class Workplace {
 public:
  explicit Workplace(const std::string& wanted) : path_(wanted), own_(wanted.empty()) {
    if (!own_) {
      files_.emplace(path_, "view");
      return;
    }
    std::string name = std::filesystem::temp_directory_path() / "canyon-view-XXXXXX";
    if (mkdtemp(name.data()) == nullptr) throw InputError(name, 0, "folder cannot be created", "set TMPDIR");
    path_ = name;
  }
  ~Workplace() {
    std::error_code error;
    if (own_) std::filesystem::remove_all(path_, error);
  }
  Workplace(const Workplace&) = delete;
  Workplace& operator=(const Workplace&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  bool own_;
  std::optional<ResultFiles> files_;
};

/// The heat map of `canyon view`, alone or over a city.
struct ViewedMap {
  std::unique_ptr<heatmap::StoredMap> map;  ///< null: none is viewed
  std::string name;
  bool alone = false;         ///< nothing else is viewed
  buildings::BuiltCity city;  ///< of --city, else an empty field around the map

  void add_to(const std::filesystem::path& folder) const {
    if (map) heatmap::add_map(*map, name, city.city, folder);
  }
};

/// Reads the map and loads its city. Throws InputError for options that exclude each other. @param finished
/// the input is a finished view, which has no city for heights
ViewedMap viewed_map(const ViewArguments& arguments, bool finished) {
  ViewedMap viewed;
  viewed.alone = std::filesystem::path(arguments.input).extension() == ".nc";
  if (viewed.alone && !arguments.map.empty())
    throw InputError("--map with a map as input", "give the city or run under the map, or leave --map out");
  const std::string file = viewed.alone ? arguments.input : arguments.map;
  if (file.empty()) {
    if (!arguments.city.empty() && !(finished && is_scenario(arguments.city))) {
      throw InputError(
          "--city without a heat map or a finished run",
          "give it with a map (--map MAP.nc), as its city, or with a finished run, as its scenario");
    }
    return viewed;
  }
  if (finished && arguments.city.empty())
    throw InputError("--map over a finished run needs its city", "give --city the run's scenario");
  viewed.map = std::make_unique<heatmap::StoredMap>(file);
  viewed.name =
      fmt::format("{}, receiver {}", std::filesystem::path(file).stem().string(), viewed.map->motion());
  const std::string city = !arguments.city.empty() ? arguments.city : viewed.alone ? "" : arguments.input;
  if (city.empty())
    viewed.city.city = heatmap::field_of(*viewed.map);
  else
    viewed.city = read_city(city_config(city), "building the city", arguments.serve.quiet);
  return viewed;
}

/// Copies the files of a view to another folder.
void copy_view(const std::filesystem::path& from, const std::filesystem::path& folder) {
  std::vector<std::string> files = view::view_files(from);
  files.emplace_back(view::kHeaderFile);
  for (const std::string& file : files) write_file(folder / file, view::read_bytes(from / file));
}

/// The view of a finished run, if `input` is a folder with one.
std::optional<std::filesystem::path> finished_view(const std::filesystem::path& input) {
  std::error_code error;
  for (const std::filesystem::path& folder : {input, input / "view"})
    if (std::filesystem::is_regular_file(folder / view::kHeaderFile, error)) return folder;
  return {};
}

/// Descriptions of the sources of a map's heights, from its features.
std::map<std::string, std::string> height_sources(const buildings::BuiltCity& built) {
  std::map<std::string, std::string> sources;
  for (const buildings::BuiltFeature& feature : built.features)
    if (feature.built) sources[feature.id] = buildings::name(feature.shape.height_source);
  return sources;
}

ReadyRun ready(const ViewArguments& arguments, const std::string& scenario) {
  RunArguments run = arguments.run;
  run.scenario = scenario;
  return make_ready(read_scenario(run), run.scenario);
}

/// Runs it into the view's folder; pages of `watching` show it meanwhile. Returns false if Ctrl-C ended it.
bool compute(const simulation::Simulation& simulation, const ViewArguments& arguments,
             simulation::EpochSink& view, view::RunRelay* watching = nullptr) {
  std::vector<simulation::EpochSink*> sinks{&view};
  simulation::RunOptions options;
  if (watching != nullptr) {
    sinks.push_back(watching);
    // Epochs are written one by one, not by the hundred.
    const std::size_t receivers = simulation.scenario().receivers.size();
    options.block = 4 * receivers * std::max(1U, std::thread::hardware_concurrency());
    options.progress = [watching](std::size_t done, std::size_t planned) {
      watching->progress(done, planned);
    };
  }
  const simulation::RunResult result = run(simulation, sinks, arguments.run, "simulating", options);
  if (!result.interrupted) return true;
  fmt::print(stderr, "canyon: interrupted: {} of {} epochs {}\n", result.epochs, result.planned,
             watching == nullptr ? "are in the view" : "were computed");
  return false;
}

view::ViewOptions view_options(const ViewArguments& arguments) {
  view::ViewOptions options;
  options.paths_per_satellite = arguments.paths;
  if (arguments.tracks.empty()) return options;
  const std::filesystem::path folder = std::filesystem::path(arguments.input).parent_path();
  const auto drive = std::make_shared<const bench::DriveFolder>(bench::read_drive(folder));
  for (const std::string& each : arguments.tracks) {
    const auto [name, file] = bench::named_file(each, "--track");
    options.tracks.push_back(
        {name,
         [drive, track = bench::read_estimate(bench::filled(file, {{"drive", drive->name}}), *drive)](
             geodesy::GpsTime time) -> std::optional<Eigen::Vector3d> {
           const double t = static_cast<double>(geodesy::unix_from_gps(time)) / 1e9 - drive->begin_unix_s;
           Eigen::Vector3d enu_m = bench::point_at(track, t).enu_m;
           if (std::isnan(enu_m.z())) enu_m.z() = bench::point_at(drive->truth, t).enu_m.z();
           if (!enu_m.allFinite()) return {};
           return drive->frame.ecef_from_local(enu_m);
         }});
  }
  return options;
}

/// Serves a scenario until Ctrl-C, from before its first epoch is computed.
int serve_run(const ViewArguments& arguments, const std::filesystem::path& page,
              const std::filesystem::path& folder, const ViewedMap& map) {
  const ReadyRun made = ready(arguments, arguments.input);
  view::ViewOptions options = view_options(arguments);
  options.watched = true;
  const auto sink = view::make_view(*made.simulation, folder, options);
  map.add_to(folder);
  view::Probe probe(*made.simulation, made.scene, arguments.paths);
  view::ServedSite site{view::read_bytes(page), folder,
                        [&probe](const std::string& message) { return probe.handle_request(message); }};
  return serve(std::move(site), arguments.serve, [&](view::Server& server) {
    view::RunRelay relay(*made.simulation, server, arguments.paths);
    if (!compute(*made.simulation, arguments, *sink, &relay)) return false;
    map.add_to(folder);
    relay.finished();
    return true;
  });
}

/// Handles requests of pages that put antennas into a view that is not being computed.
struct Antennas {
  std::unique_ptr<view::Probe> probe;
  std::string why_not =
      "There is no scenario for tracing: start 'canyon view SCENARIO', or for a finished run, a validation "
      "or a heat map 'canyon view WHAT --city SCENARIO'.";
};

std::unique_ptr<view::Probe> probe_of_run(const ViewArguments& arguments,
                                          const std::filesystem::path& folder) {
  const ReadyRun made = ready(arguments, arguments.city);
  view::check_run(folder, *made.simulation);
  return std::make_unique<view::Probe>(*made.simulation, made.scene, arguments.paths);
}

/// The recording gives the city's position, so none is sampled.
std::unique_ptr<view::Probe> probe_of_validation(const ViewArguments& arguments,
                                                 const std::filesystem::path& folder) {
  const simulation::Scenario scenario = simulation::read_scenario(arguments.city, {false});
  city::City city = simulation::load_city(simulation::city_config(scenario), scenario.seed);
  print_report(city.notes, "canyon check SCENARIO");
  return validation::comparison_probe(
      folder, scenario, std::make_shared<simulation::CityScene>(std::move(city)), arguments.paths);
}

/// Uses the scenario of --city, which must be that of the finished run or validation.
Antennas antennas_in_finished(const ViewArguments& arguments, const std::filesystem::path& folder) {
  Antennas antennas;
  try {
    antennas.probe = validation::is_comparison(folder) ? probe_of_validation(arguments, folder)
                                                       : probe_of_run(arguments, folder);
  } catch (const Error& error) {
    if (arguments.map.empty()) throw;
    antennas.why_not = error.what();  // only the city was requested
  }
  return antennas;
}

/// The same for a heat map, from its first time on; `header` gets the scenario's receivers.
Antennas antennas_in_map(const ViewArguments& arguments, const ViewedMap& map, view::ViewHeader& header) {
  const simulation::Scenario scenario = simulation::read_scenario(arguments.city, {false});
  header.begin = map.map->times().front();
  header.interval_s = 1 / scenario.rate_hz.value_or(1);
  header.paths_per_satellite = arguments.paths;
  for (const simulation::ReceiverConfig& receiver : scenario.receivers)
    header.receivers.push_back(view::receiver_header(receiver.options));
  Antennas antennas;
  antennas.probe =
      std::make_unique<view::Probe>(scenario, map.map->times().front(), header.interval_s,
                                    std::make_shared<simulation::CityScene>(map.city.city), arguments.paths);
  return antennas;
}

/// The header of a city's view. Writes the city's mesh to the folder.
view::ViewHeader city_header(const ViewArguments& arguments, const buildings::BuiltCity& built,
                             const std::filesystem::path& folder) {
  view::ViewHeader header;
  header.title = std::filesystem::path(arguments.input).stem().string();
  header.city = view::write_city(built.city, height_sources(built), folder);
  return header;
}

/// Serves a city with the data of hosts, until Ctrl-C.
void serve_live_city(const ViewArguments& arguments, const buildings::BuiltCity& built) {
  const Workplace workplace("");
  LiveView live{arguments.live, city_header(arguments, built, workplace.path()),
                std::make_shared<simulation::CityScene>(built.city)};
  if (is_scenario(arguments.input)) live.scenario = simulation::read_scenario(arguments.input, {false});
  live.paths_per_satellite = arguments.paths;
  serve_live(std::move(live), workplace.path(), arguments.serve);
}

/// Throws InputError for options that exclude each other. @param serves the view is served, not written
void check_together(const ViewArguments& arguments, bool serves) {
  if (!serves && (arguments.serve.open || arguments.serve.port != 0)) {
    throw InputError("--open and --port serve a view, but --export, --out and --record write one",
                     "leave either of them out");
  }
  if (!arguments.live.empty() && (!serves || !arguments.map.empty() || !arguments.city.empty())) {
    throw InputError("--live serves a view in the city of WHAT and cannot write one",
                     "leave --export, --out, --record, --map and --city out");
  }
}

/// Writes the requested page and film of the view in `folder`.
void write_pages(const ViewArguments& arguments, const std::filesystem::path& page,
                 const std::filesystem::path& folder) {
  const bool quiet = arguments.serve.quiet;
  if (!arguments.exported.empty()) {
    const std::size_t bytes = view::export_page(page, folder, arguments.exported);
    if (!quiet) {
      fmt::print(stderr, "{}: {:.2f} MB, opens from disk\n", arguments.exported,
                 static_cast<double>(bytes) / 1e6);
    }
  }
  if (arguments.record.file.empty()) return;
  const Workplace film("");
  view::export_page(page, folder, film.path() / "scene.html");
  record_page(arguments.record, page, film.path() / "scene.html", film.path(), quiet);
}

int run_view(const ViewArguments& given) {
  ViewArguments arguments = given;
  arguments.run.quiet = arguments.serve.quiet;
  const bool filmed = !arguments.record.file.empty();
  const bool serves = arguments.exported.empty() && arguments.out.empty() && !filmed;
  check_together(arguments, serves);
  // A drive of a bench is viewed by its scenario.
  const std::filesystem::path drive = arguments.input;
  if (std::filesystem::exists(drive / "card.yaml"))
    arguments.input = (drive / "scenario.yaml").string();
  else if (!arguments.tracks.empty())
    throw InputError(
        "--track: " + arguments.input + " is not a drive of a bench",
        "make one: canyon bench make DIR --only middle; then canyon view DIR/middle --track mine=FILE");
  const auto built_city = [&] {
    buildings::BuiltCity city =
        read_city(city_config(arguments.input), "building the city", arguments.serve.quiet);
    print_report(city.city.notes, "canyon check " + arguments.input);
    return city;
  };
  if (!arguments.live.empty()) {
    serve_live_city(arguments, built_city());
    return kOk;
  }
  // The page first: a missing viewer should not end a run of minutes.
  const bool paged = serves || filmed || !arguments.exported.empty();
  const std::filesystem::path page = paged ? view::find_page() : "";
  if (filmed) check_record(arguments.record, page);
  const std::optional<std::filesystem::path> finished = finished_view(arguments.input);
  if (finished) {
    (void)view::view_files(*finished);
  } else if (std::filesystem::is_directory(arguments.input)) {
    throw InputError(arguments.input, 0, "is a folder without a view",
                     "write one with 'canyon simulate SCENARIO --out DIR --view', or show the scenario");
  }
  // A page without a server cannot send requests.
  const bool requested = serves && !arguments.city.empty() && is_scenario(arguments.city);
  Antennas antennas;
  std::optional<Workplace> workplace;
  std::filesystem::path folder;
  bool interrupted = false;
  const ViewedMap map = viewed_map(arguments, finished.has_value());
  if (finished && !map.map) {
    folder = *finished;
  } else {
    workplace.emplace(arguments.out);
    folder = workplace->path();
    if (finished) {
      copy_view(*finished, folder);
    } else if (is_scenario(arguments.input)) {
      if (serves) return serve_run(arguments, page, folder, map);
      const ReadyRun made = ready(arguments, arguments.input);
      const auto sink = view::make_view(*made.simulation, folder, view_options(arguments));
      interrupted = !compute(*made.simulation, arguments, *sink);
    } else {
      view::ViewHeader header = city_header(arguments, map.alone ? map.city : built_city(), folder);
      if (requested && map.alone) antennas = antennas_in_map(arguments, map, header);
      view::write_header(header, folder);
    }
    map.add_to(folder);
  }
  if (requested && finished) antennas = antennas_in_finished(arguments, folder);
  write_pages(arguments, page, folder);
  if (interrupted) return kInterrupted;
  if (!serves) return kOk;
  return serve({view::read_bytes(page), folder,
                [&antennas](const std::string& message) {
                  return antennas.probe ? antennas.probe->handle_request(message)
                                        : view::no_probe(message, antennas.why_not);
                }},
               arguments.serve);
}

}  // namespace

void add_view(Command& app) {
  Command& command = app.add_command("view", "show a run or a city in the browser");
  ViewArguments& arguments = command.run_with(run_view);
  command
      .add_option("input", arguments.input, "WHAT",
                  "a scenario, which is run; a folder that --out, 'canyon simulate --view' or 'canyon "
                  "validate --view DIR' wrote; a drive of 'canyon bench make'; a heat map "
                  "(map.nc); or a city, any file that 'canyon city info' reads")
      .required();
  command
      .add_option("--export", arguments.exported, "HTML",
                  "one HTML file that opens from disk, without a server or network")
      .writes();
  command.add_option("-o,--out", arguments.out, "DIR", "folder for the view's files (docs/view-format.md)");
  command.add_option("--map", arguments.map, "MAP.nc", "heat map of the same city, drawn over it");
  command.add_option("--city", arguments.city, "CITY",
                     "city of a heat map: a city, or a scenario, with which antennas can be put in it as "
                     "well; for a finished run or a validation: its scenario");
  command
      .add_option(
          "--track", arguments.tracks, "NAME=FILE",
          "an estimate of a drive of the bench, shown next to the receiver; may be given several times")
      .repeated();
  add_run_field(command, "--duration", arguments.run, "duration_s");
  command
      .add_option(
          "--paths", arguments.paths, "N",
          fmt::format("largest number of paths of each satellite, the strongest ones ({})", arguments.paths))
      .within(1, 1000);
  add_record_options(command, arguments.record);
  command
      .add_option(
          "--live", arguments.live, "ADDRESS",
          "in the city of WHAT, the data of a host's stream 'view=ADDRESS': canyon live, a plugin of Gazebo, "
          "a ROS node; tcp://127.0.0.1:PORT, of several receivers one each; may be given several times")
      .repeated();
  command.add_option("--port", arguments.serve.port, "N", "port of 127.0.0.1 for the server (a free one)")
      .within(0, 65535);
  command.add_flag("--open", arguments.serve.open, "open it in the browser (xdg-open)");
  add_threads(command, arguments.run.threads);
  command.add_flag("--quiet", arguments.serve.quiet, "print warnings and errors only");
}

}  // namespace canyon::cli
