#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>

#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/output/sinks.hpp"
#include "canyon/run/scenario/scenario.hpp"
#include "canyon/studies/bench/drives.hpp"
#include "canyon/studies/bench/page.hpp"
#include "canyon/studies/bench/score.hpp"
#include "cli/commands.hpp"
#include "cli/program.hpp"
#include "cli/progress.hpp"
#include "cli/scenario_run.hpp"

namespace canyon::bench {
extern const char* const ekf_py;
}

namespace canyon::cli {
namespace {

namespace fs = std::filesystem;

struct MakeArguments {
  std::string out;
  std::vector<std::string> only, receivers, map;
  std::size_t seeds = 1;
  int threads = 0;
  bool quiet = false;
};
struct ScoreArguments {
  std::string bench, limits, json, junit, html, command_estimate = "mine";
  std::vector<std::string> estimates, command, only;
  bool quiet = false;
};

int run_list(const MakeArguments& /*none*/) {
  std::vector<TextRow> rows;
  for (const bench::BenchDrive& drive : bench::catalogue().drives)
    rows.push_back(
        {drive.name, drive.town, drive.way, fmt::format("{}", fmt::join(drive.needs, ", ")), drive.about});
  print_table({"drive", "town", "way", "needs", "what goes wrong"}, rows);
  return kOk;
}

std::vector<const bench::BenchDrive*> chosen(const std::vector<std::string>& only) {
  std::vector<const bench::BenchDrive*> drives;
  std::vector<std::string> names;
  for (const bench::BenchDrive& drive : bench::catalogue().drives) {
    names.push_back(drive.name);
    if (only.empty() || std::count(only.begin(), only.end(), drive.name) > 0) drives.push_back(&drive);
  }
  for (const std::string& name : only) {
    if (std::count(names.begin(), names.end(), name) > 0) continue;
    const auto meant = closest(name, names);
    throw InputError(fmt::format("--only: there is no drive '{}'", name),
                     meant ? fmt::format("did you mean '{}'?", *meant) : "canyon bench list names them");
  }
  return drives;
}

/// City, start and trajectory of the user's map and track, as `canyon new` writes them.
std::string own_place(const std::vector<std::string>& files, const fs::path& folder) {
  std::string own;
  if (files.empty()) return own;
  bool taken = false;
  const NewScenario made = new_scenario(files, (folder / "scenario.yaml").string());
  for (const std::string_view line : split(made.yaml, '\n')) {
    if (!line.empty() && line[0] != ' ') {
      taken = false;
      for (const char* key : {"city:", "trajectory:", "start:", "duration_s:"})
        taken = taken || line.starts_with(key);
    }
    if (!taken) continue;
    own += std::string(line) + "\n";
    if (line.starts_with("  speed_mps:")) own += "  acceleration_mps2: 2\n";  // inertial sensors need it
  }
  own += "surroundings: auto\n";
  return own;
}

void make_drive(const MakeArguments& arguments, const bench::BenchDrive& drive, const std::string& profile,
                const std::string& yaml, const fs::path& folder) {
  const std::string file = (folder / "scenario.yaml").string();
  simulation::Scenario scenario = simulation::parse_scenario(yaml, file);
  ReadyRun ready = make_ready(std::move(scenario), file);
  auto sinks = output::make_file_sinks(*ready.simulation, folder);
  sinks.push_back(bench::make_drive_sink(*ready.simulation, drive, profile, folder));
  std::vector<simulation::EpochSink*> all;
  all.reserve(sinks.size());
  for (const auto& sink : sinks) all.push_back(sink.get());
  RunArguments run_arguments;
  run_arguments.threads = arguments.threads;
  run_arguments.quiet = arguments.quiet;
  if (run(*ready.simulation, all, run_arguments, drive.name.c_str()).interrupted) throw Interrupted();
  write_file(file, yaml);
}

/// The shipped estimator of 100 lines runs on each drive, if there is a Python with NumPy.
void run_baselines(const fs::path& bench, const std::vector<fs::path>& drives, bool quiet) {
  write_file(bench / "ekf.py", bench::ekf_py);
  if (!is_installed("python3") || run_program({"python3", "-c", "import numpy"}, {"/dev/null", {}}) != kOk) {
    print_warnings({"the baselines ekf and robust are left out: there is no python3 with NumPy"});
    return;
  }
  Progress progress("baselines", quiet);
  for (std::size_t i = 0; i < drives.size(); ++i) {
    for (const bool robust : {false, true}) {
      std::vector<std::string> words{"python3", (bench / "ekf.py").string(), drives[i].string(),
                                     (drives[i] / (robust ? "robust.csv" : "ekf.csv")).string()};
      if (robust) words.emplace_back("--robust");
      if (run_program(words) != kOk) print_warnings({fmt::format("{}: ekf.py failed", drives[i].string())});
    }
    progress.update(i + 1, drives.size());
  }
}

int run_make(const MakeArguments& arguments) {
  const auto drives = chosen(arguments.only);
  const fs::path out = arguments.out;
  ResultFiles files(out, "bench");
  const std::vector<std::string> receivers =
      arguments.receivers.empty() ? std::vector<std::string>{"ublox-m10"} : arguments.receivers;
  std::optional<std::string> own;
  std::vector<fs::path> made;
  for (const bench::BenchDrive* drive : drives) {
    for (const std::string& receiver : receivers) {
      for (std::size_t seed = 1; seed <= arguments.seeds; ++seed) {
        std::string name = drive->name;
        if (receivers.size() > 1) name += "-" + receiver;
        if (arguments.seeds > 1) name += fmt::format("-{}", seed);
        const fs::path folder = out / name;
        fs::create_directories(folder);
        if (!own) own = own_place(arguments.map, folder);  // its paths count from the folder of a drive
        make_drive(arguments, *drive, receiver, bench::scenario_of(*drive, receiver, seed, *own), folder);
        made.push_back(folder);
      }
    }
  }
  run_baselines(out, made, arguments.quiet);
  note(arguments.quiet,
       fmt::format("{} drives in {}. Next: canyon bench run {} -- PROGRAM {{drive}} {{estimate}}",
                   made.size(), arguments.out, arguments.out));
  return kOk;
}

/// The tracks of a drive by the name of their estimate: the fixes, the baselines, and the user's.
std::map<std::string, bench::Track> tracks_of(const bench::DriveFolder& drive,
                                              const ScoreArguments& arguments) {
  std::map<std::string, bench::Track> tracks{{"fixes", drive.fixes}};
  for (const char* baseline : {"single", "ekf", "robust"}) {
    const fs::path file = drive.folder / (std::string(baseline) + ".csv");
    if (fs::exists(file)) tracks[baseline] = bench::read_estimate(file, drive);
  }
  for (const std::string& each : arguments.estimates) {
    const auto [name, file] = bench::named_file(each, "--estimate", drive);
    if (!fs::exists(file))
      print_warnings({fmt::format("{}: there is no {}; it counts as absent", drive.name, file.string())});
    tracks[name] = fs::exists(file) ? bench::read_estimate(file, drive) : bench::Track();
  }
  return tracks;
}

int score_bench(const ScoreArguments& arguments) {
  bench::LimitsFile limits;
  if (!arguments.limits.empty()) limits = bench::read_limits(arguments.limits);
  const std::vector<fs::path> folders = bench::drives_in(arguments.bench);
  for (const bench::Limits& each : limits.limits)
    for (const std::string& name : each.drives)
      if (!fs::exists(fs::path(arguments.bench) / name / "card.yaml"))
        throw InputError(arguments.limits, 0, fmt::format("'{}' is no drive of {}", name, arguments.bench),
                         "make it, or leave it out of the limits");
  std::vector<bench::Result> results;
  std::vector<bench::DriveFolder> drives;
  std::map<std::string, std::map<std::string, bench::Track>> tracks;
  for (const fs::path& folder : folders) {
    drives.push_back(bench::read_drive(folder));
    const bench::DriveFolder& drive = drives.back();
    tracks[drive.name] = tracks_of(drive, arguments);
    for (const auto& [name, track] : tracks[drive.name]) {
      bench::Result& result = results.emplace_back(
          bench::Result{drive.name, name, bench::score(drive, track, limits.recovered_m), {}});
      const std::string begin = name + "=";
      const bool mine = std::any_of(arguments.estimates.begin(), arguments.estimates.end(),
                                    [&](const std::string& each) { return each.starts_with(begin); });
      if (mine) result.violations = bench::violations(drive.name, result.score, limits.limits);
    }
  }
  if (!arguments.quiet && arguments.json != "-") {
    std::vector<TextRow> rows;
    rows.reserve(results.size());
    for (const bench::Result& each : results) rows.push_back(bench::result_cells(each));
    print_table(bench::result_head(), rows);
  }
  const std::string html =
      arguments.html.empty() ? (fs::path(arguments.bench) / "score.html").string() : arguments.html;
  write_file(html, bench::page(results, drives, tracks));
  if (arguments.json == "-")
    fmt::print("{}\n", bench::to_json(results).dump(1));
  else if (!arguments.json.empty())
    write_file(arguments.json, bench::to_json(results).dump(1) + "\n");
  if (!arguments.junit.empty()) write_file(arguments.junit, bench::to_junit(results));
  note(arguments.quiet, "pictures of all drives: " + html);
  int failed = 0;
  for (const bench::Result& each : results) {
    for (const std::string& violation : each.violations)
      fmt::print(stderr, "{}, {}: {}\n", each.drive, each.estimate, violation);
    failed += each.violations.empty() ? 0 : 1;
  }
  if (!arguments.limits.empty()) note(arguments.quiet, fmt::format("{} drives beyond the limits", failed));
  return failed > 0 ? kFailure : kOk;
}

int run_run(const ScoreArguments& given) {
  ScoreArguments arguments = given;
  for (const char* word : {"{drive}", "{estimate}"}) {
    if (std::none_of(arguments.command.begin(), arguments.command.end(),
                     [&](const std::string& each) { return each.find(word) != std::string::npos; }))
      throw InputError(arguments.command.empty() ? std::string("there is no program to run")
                                                 : fmt::format("the program is not told {}", word),
                       "give it behind --: -- python3 my_ekf.py {drive} {estimate}");
  }
  const fs::path estimates = fs::path(arguments.bench) / "estimates" / arguments.command_estimate;
  fs::create_directories(estimates);
  const auto folders = bench::drives_in(arguments.bench);
  Progress progress("estimating", arguments.quiet);
  bool failed = false;
  for (std::size_t i = 0; i < folders.size(); ++i) {
    const fs::path estimate = estimates / (folders[i].filename().string() + ".csv");
    fs::remove(estimate);
    std::vector<std::string> words = arguments.command;
    for (std::string& word : words) {
      replace_all(word, "{drive}", folders[i].string());
      replace_all(word, "{estimate}", estimate.string());
    }
    if (const int status = run_program(words); status != kOk) {
      print_warnings(
          {fmt::format("{}: the program ended with status {}", folders[i].filename().string(), status)});
      fs::remove(estimate);
      failed = true;
    }
    progress.update(i + 1, folders.size());
  }
  arguments.estimates.push_back(arguments.command_estimate + "=" + (estimates / "{drive}.csv").string());
  const int scored = score_bench(arguments);
  return failed ? kFailure : scored;
}

void add_score_options(Command& command, ScoreArguments& arguments) {
  command.add_option("bench", arguments.bench, "DIR", "folder of `canyon bench make`").required();
  command
      .add_option("--estimate", arguments.estimates, "NAME=FILE",
                  "an estimate, CSV or TUM; {drive} stands for the drive's name; may be repeated")
      .repeated();
  command.add_option("--limits", arguments.limits, "FILE", "YAML of what must hold; else the exit code is 1");
  command.add_option("--json", arguments.json, "FILE", "scores as JSON; -: to standard output, alone")
      .writes();
  command.add_option("--junit", arguments.junit, "FILE", "a test case for each drive, for CI").writes();
  command.add_option("--html", arguments.html, "FILE", "page with pictures (DIR/score.html)").writes();
  command.add_flag("--quiet", arguments.quiet, "print warnings and errors only");
}

}  // namespace

void add_bench(Command& app) {
  Command& bench = app.add_command("bench", "put an estimator on drives where GNSS goes wrong, and score it");
  Command& list = bench.add_command("list", "list the drives");
  (void)list.run_with(run_list);

  Command& make = bench.add_command("make", "simulate drives: truth, fixes, IMU, wheels, raw data, events");
  MakeArguments& arguments = make.run_with(run_make);
  make.add_option("out", arguments.out, "DIR", "folder of the bench").required();
  make.add_option("--only", arguments.only, "NAME", "drives (all)");
  make.add_option("--receiver", arguments.receivers, "PROFILE",
                  "receivers (ublox-m10); ublox-f9p has a base for RTK");
  make.add_option("--seeds", arguments.seeds, "N", "realizations of each drive (1)").within(1, 100);
  make.add_option("--map", arguments.map, "FILE",
                  "a map, and a track: its place instead of the made-up towns");
  add_threads(make, arguments.threads);
  make.add_flag("--quiet", arguments.quiet, "print warnings and errors only");
  make.footer = "docs/bench.md describes the files of a drive.";

  Command& run = bench.add_command("run", "run a program on each drive, and score it");
  ScoreArguments& run_arguments = run.run_with(run_run);
  add_score_options(run, run_arguments);
  run.add_option("--name", run_arguments.command_estimate, "NAME", "name of the program's estimate (mine)");
  run.add_option("command", run_arguments.command, "PROGRAM",
                 "behind --: the program; {drive} is the drive's folder, {estimate} the file to write");
  run.footer = "Example: canyon bench run out/bench -- python3 my_ekf.py {drive} {estimate}";

  Command& score = bench.add_command("score", "score estimates, beside the fixes and two small filters");
  add_score_options(score, score.run_with(score_bench));
}

}  // namespace canyon::cli
