#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/drawing/views/pictures.hpp"
#include "canyon/outputs/encoding/sinks.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/outputs/view/view_sink.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "cli/commands.hpp"
#include "cli/progress.hpp"
#include "cli/scenario_run.hpp"

namespace canyon::cli {
namespace {

namespace fs = std::filesystem;

/// Pictures of a receiver take about a second, its epochs often less.
constexpr std::size_t kMaxRendered = 16;

struct SimulateArguments : RunArguments {
  std::vector<std::string> files;  ///< one scenario, or those of `canyon new`
  std::string out;
  std::vector<std::string> streams;
  bool realtime = false, view = false;
};

/// Numbers of satellites by system: "GPS 9, BeiDou 14".
std::string count_systems(const std::vector<gnss::SatelliteId>& satellites) {
  std::string text;
  for (const gnss::System system : gnss::kAllSystems) {
    const auto n = std::count_if(satellites.begin(), satellites.end(),
                                 [system](gnss::SatelliteId id) { return id.system == system; });
    if (n > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", gnss::name(system), n);
  }
  return text;
}

/// Loads the city and prepares the scenario. Prints city, sky and trajectory.
std::unique_ptr<simulation::Simulation> make_simulation(simulation::Scenario scenario, bool quiet) {
  const auto note = [quiet](const std::string& text) { cli::note(quiet, text); };
  const auto load_begin = std::chrono::steady_clock::now();
  city::City city = simulation::load_city(scenario);
  const city::CitySummary summary = city::summarize(city);
  note(fmt::format("city        {}: {} buildings, {} triangles, {:.0f} m x {:.0f} m ({:.2f} s)", city.name,
                   summary.buildings, summary.triangles,
                   summary.triangles > 0 ? summary.bounds.max.x() - summary.bounds.min.x() : 0,
                   summary.triangles > 0 ? summary.bounds.max.y() - summary.bounds.min.y() : 0,
                   seconds_since(load_begin)));
  auto simulation = std::make_unique<simulation::Simulation>(std::move(scenario), std::move(city));
  note(fmt::format("sky         {}", count_systems(simulation->environment().sky().satellites())));
  note(fmt::format("trajectory  {:.0f} m, {} epochs every {} s from {}", simulation->trajectory().length_m(),
                   simulation->epoch_count(), simulation->interval_s(),
                   geodesy::format_gpst(simulation->begin(), 0)));
  return simulation;
}

/// All outputs of the run in its folder.
std::vector<std::unique_ptr<simulation::EpochSink>> make_sinks(const simulation::Simulation& simulation,
                                                               const SimulateArguments& arguments) {
  const simulation::Scenario& scenario = simulation.scenario();
  std::vector<std::unique_ptr<simulation::EpochSink>> sinks =
      encoding::make_file_sinks(simulation, arguments.out);
  if (scenario.outputs.has("pictures")) {
    const std::size_t sampled = std::min(scenario.receivers.size(), kMaxRendered);
    for (std::size_t i = 0; i < sampled; ++i) {
      sinks.push_back(drawing::make_pictures(
          simulation, encoding::receiver_folder(simulation, arguments.out, i), i, &catch_interrupts()));
    }
    if (sampled < scenario.receivers.size()) {
      note(arguments.quiet,
           fmt::format("pictures    of the first {} of {} receivers", sampled, scenario.receivers.size()));
    }
  }
  if (arguments.view) sinks.push_back(view::make_view(simulation, fs::path(arguments.out) / "view"));
  return sinks;
}

/// The scenario of the command line, or one that `canyon new` would write.
simulation::Scenario scenario_of(SimulateArguments& arguments) {
  arguments.scenario = arguments.files.front();
  if (arguments.files.size() == 1 && !simulation::source_of_file(arguments.scenario))
    return read_scenario(arguments);
  const NewScenario made = new_scenario(arguments.files, "new.yaml");
  for (const std::string& fact : made.facts) note(arguments.quiet, "assumed     " + fact);
  simulation::Scenario scenario = simulation::parse_scenario(made.yaml, "new.yaml");
  make(arguments.changes, scenario);
  return scenario;
}

int run_simulate(const SimulateArguments& given) {
  SimulateArguments arguments = given;
  const auto note = [&arguments](const std::string& text) { cli::note(arguments.quiet, text); };
  const simulation::Scenario scenario = scenario_of(arguments);
  ResultFiles files(arguments.out, "simulate");
  const std::string report_file = (fs::path(arguments.out) / "report.txt").string();
  ResultFiles::refuse(report_file);
  const std::unique_ptr<simulation::Simulation> made = make_simulation(scenario, arguments.quiet);
  const simulation::Simulation& simulation = *made;
  print_report(simulation.report(), report_file);

  const std::atomic<bool>& stop_requested = catch_interrupts();
  const auto sinks = make_sinks(simulation, arguments);
  std::vector<std::unique_ptr<encoding::EncodedStream>> streams;
  const auto report_notes = [&](std::size_t i) {
    for (const std::string& line : streams[i]->take_notes())
      note(fmt::format("stream      {}: {}", arguments.streams[i], line));
  };
  for (const std::string& text : arguments.streams) {
    streams.push_back(encoding::open_stream(encoding::parse_stream(text), simulation));
    report_notes(streams.size() - 1);
  }
  encoding::SummarySink metrics(simulation::receiver_names(scenario.receivers));
  encoding::RealTimePacer pacer(&stop_requested, [&] {
    for (std::size_t i = 0; i < streams.size(); ++i) {
      streams[i]->serve();
      report_notes(i);
    }
  });
  std::vector<simulation::EpochSink*> all;
  if (arguments.realtime) all.push_back(&pacer);
  all.push_back(&metrics);
  for (const auto& sink : sinks) all.push_back(sink.get());
  for (const auto& stream : streams) all.push_back(stream.get());

  simulation::RunResult result;
  try {
    result = run(simulation, all, arguments, "simulating", {}, report_file);
  } catch (const OutputError& e) {
    throw OutputError(fmt::format("{}; the other files in {} contain at most {} epochs", e.what(),
                                  arguments.out, metrics.summaries().front().epochs));
  }
  for (std::size_t i = 0; i < streams.size(); ++i) report_notes(i);
  ReadReport report = simulation.report();
  report.add_line(ReadReport::Level::Guess, result.warnings);
  report.write(arguments.out);
  if (const std::size_t removed = files.finish(); removed > 0)
    note(fmt::format("removed     {} files of an earlier run from {}", removed, arguments.out));
  if (!arguments.quiet) fmt::print("\n{}\n", encoding::format_summary_table(metrics.summaries()));
  // An interrupt before pictures are drawn omits them.
  if (result.interrupted || (scenario.outputs.has("pictures") && stop_requested.load())) {
    fmt::print(stderr, "canyon: interrupted: {} of {} epochs finished and written to {}{}\n", result.epochs,
               result.planned, arguments.out, scenario.outputs.has("pictures") ? ", without pictures" : "");
    return kInterrupted;
  }
  note(fmt::format("{} epochs in {:.2f} s, {:.0f} times real time; results in {}", result.epochs,
                   result.wall_s, result.simulated_s / std::max(result.wall_s, 1e-9), arguments.out));
  return kOk;
}

/// The names of the keys below `outputs`.
std::vector<std::string> output_keys() {
  constexpr std::string_view kGroup = "outputs.";
  std::vector<std::string> names;
  for (const options::Key& key : simulation::scenario_keys())
    if (key.path.starts_with(kGroup)) names.push_back(key.path.substr(kGroup.size()));
  return names;
}

}  // namespace

void add_simulate(Command& app) {
  Command& command = app.add_command("simulate", "simulate a scenario's receivers and write their outputs");
  SimulateArguments& arguments = command.run_with(run_simulate);
  command
      .add_option("scenario", arguments.files, "SCENARIO",
                  "scenario file (YAML); or files as for `canyon new`, whose scenario is not written")
      .required();
  command.add_option("-o,--out", arguments.out, "DIR", "folder for the results, created if missing")
      .required();
  add_run_field(command, "--rate", arguments, "rate_hz");
  add_run_options(command, arguments);
  std::string live;
  for (const encoding::Format& format : encoding::formats())
    if (format.live) live += fmt::format("{}, ", format.name);
  command
      .add_option("--stream", arguments.streams, "STREAM",
                  "send a format during the run, [RECEIVER/]FORMAT=ADDRESS; may be repeated. "
                  "Formats: " +
                      live + "; files may have all others. Addresses: " + transport::address_forms() +
                      "; an address may end in ?rate_hz=5&latency_s=0.1&jitter_s=0.02")
      .repeated();
  command.add_flag("--realtime", arguments.realtime, "no faster than the wall clock");
  command.add_flag("--view", arguments.view, "also write DIR/view for 'canyon view DIR'");
  command.footer = fmt::format(
      "Files by 'outputs: {{NAME: true}}' in the scenario: {}.\n"
      "'canyon scenario keys' lists every key of a scenario.",
      fmt::join(output_keys(), ", "));
}

}  // namespace canyon::cli
