#pragma once

#include <memory>
#include <string>
#include <vector>

#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "cli/field_option.hpp"

namespace canyon::cli {

struct RunArguments {
  std::string scenario;
  Changes<simulation::Scenario> changes;
  int threads = 0;
  bool quiet = false;
};
/// Adds SCENARIO.
void add_scenario_file(Command& command, std::string& scenario, const char* about = "scenario file (YAML)");
/// Adds `flag` for a field of the scenario's run (simulation::visit_run()).
void add_run_field(Command& command, const std::string& flag, RunArguments& arguments,
                   const std::string& name);
/// Adds --seed, --duration, --threads and --quiet.
void add_run_options(Command& command, RunArguments& arguments);

/// The scenario with the command line's changes.
[[nodiscard]] simulation::Scenario read_scenario(const RunArguments& arguments,
                                                 simulation::ScenarioReadOptions options = {});
/// Prints a scenario as YAML, without the passwords and keys of its addresses; notes their removal.
void print_scenario(const simulation::Scenario& scenario);
struct ReadyRun {
  std::shared_ptr<simulation::CityScene> scene;
  std::unique_ptr<simulation::Simulation> simulation;
};
/// Loads the city and prepares the scenario for the run. Prints the warnings of the scenario, the city, the
/// trajectory and the sky. @param file of the scenario
[[nodiscard]] ReadyRun make_ready(simulation::Scenario scenario, const std::string& file);
/// Runs it until its end or Ctrl-C, with a progress line. @param doing text of the line @param options
/// threads and stop are set here; its progress is called in addition to the line @param report_file with all
/// warnings of the run; empty: none
[[nodiscard]] simulation::RunResult run(const simulation::Simulation& simulation,
                                        const std::vector<simulation::EpochSink*>& sinks,
                                        const RunArguments& arguments, const char* doing,
                                        simulation::RunOptions options = {},
                                        const std::string& report_file = {});

/// A scenario made from a city and the files next to it.
struct NewScenario {
  std::string yaml;
  std::vector<std::string> facts;  ///< contents and assumptions, a line each
  ReadReport report;               ///< of preparing the scenario
};
enum class ScenarioPart { City, Navigation, Precise, Track };
/// The part of a scenario that `canyon new` makes from a file. Throws InputError for a file of no use there.
[[nodiscard]] ScenarioPart scenario_part(const std::filesystem::path& file);
/// The scenario that `canyon new` writes, prepared for a run once. Throws InputError for files of no use in a
/// scenario, and as their readers do. @param name of its file; names of files in it are relative to its
/// folder @param origin "LAT,LON,HEIGHT" or ""
[[nodiscard]] NewScenario new_scenario(const std::vector<std::string>& files, const std::string& name,
                                       const std::string& origin = {});

}  // namespace canyon::cli
