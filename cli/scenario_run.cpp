#include "cli/scenario_run.hpp"

#include <fmt/format.h>

#include "canyon/base/input_error.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "cli/commands.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {

void add_scenario_file(Command& command, std::string& scenario, const char* about) {
  command.add_option("scenario", scenario, "SCENARIO", about).required();
}

void add_run_field(Command& command, const std::string& flag, RunArguments& arguments,
                   const std::string& name) {
  add_change(command, flag, arguments.changes, name, simulation::visit_run, "the scenario's");
}

void add_run_options(Command& command, RunArguments& arguments) {
  add_run_field(command, "--seed", arguments, "seed");
  add_run_field(command, "--duration", arguments, "duration_s");
  add_threads(command, arguments.threads);
  command.add_flag("--quiet", arguments.quiet, "print warnings and errors only");
}

simulation::Scenario read_scenario(const RunArguments& arguments, simulation::ScenarioReadOptions options) {
  simulation::Scenario scenario = simulation::read_scenario(arguments.scenario, options);
  make(arguments.changes, scenario);
  return scenario;
}

void print_scenario(const simulation::Scenario& scenario) {
  const std::string yaml = simulation::scenario_yaml(scenario), shown = hide_passwords(yaml);
  fmt::print("{}", shown);
  if (shown != yaml) print_warnings({"passwords of addresses are shown as '...'; replace them to run it"});
}

ReadyRun make_ready(simulation::Scenario scenario, const std::string& file) {
  ReadyRun ready;
  ready.scene = std::make_shared<simulation::CityScene>(simulation::load_city(scenario));
  ready.simulation = std::make_unique<simulation::Simulation>(std::move(scenario), ready.scene);
  print_report(ready.simulation->report(), "canyon check " + file);
  return ready;
}

simulation::RunResult run(const simulation::Simulation& simulation,
                          const std::vector<simulation::EpochSink*>& sinks, const RunArguments& arguments,
                          const char* doing, simulation::RunOptions options, const std::string& report_file) {
  simulation::RunResult result;
  {
    ProgressLine progress(doing, arguments.quiet);
    options.threads = arguments.threads;
    options.stop = &catch_interrupts();
    options.progress = [&progress, also = options.progress](std::size_t done, std::size_t planned) {
      progress.update(done, planned);
      if (also) also(done, planned);
    };
    result = simulation.run(sinks, options);
  }
  ReadReport report;
  report.add_line(ReadReport::Level::Guess, result.warnings);
  print_report(report, report_file.empty() ? "canyon simulate " + arguments.scenario : report_file);
  return result;
}

}  // namespace canyon::cli
