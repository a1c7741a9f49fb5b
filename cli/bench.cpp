#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <set>

#include "canyon/analysis/bench/drives.hpp"
#include "canyon/analysis/bench/page.hpp"
#include "canyon/analysis/bench/score.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/sinks.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
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

constexpr std::array kBaselines{"fixes", "single", "ekf", "robust"};

struct MakeArguments {
  std::string out;
  std::vector<std::string> only, receivers, map;
  std::size_t seeds = 1;
  int edition = bench::kEdition, threads = 0;
  bool quiet = false;
};
struct ScoreArguments {
  std::string bench, limits, json, junit, html, command_estimate = "mine";
  std::vector<std::string> estimates, command, reads;
  double timeout_s = 600;
  bool quiet = false;
};

int run_list(const MakeArguments& arguments) {
  std::vector<TextRow> rows;
  for (const bench::BenchDrive& drive : bench::catalogue(arguments.edition).drives)
    rows.push_back(
        {drive.name, drive.town, drive.route, fmt::format("{}", fmt::join(drive.needs, ", ")), drive.about});
  print_table({"drive", "town", "route", "needs", "failure"}, rows);
  return kOk;
}

/// Throws InputError for the first unknown name: "--only: there is no drive 'outlyer'; did you mean ...".
void check_known(const std::vector<std::string>& given, const std::vector<std::string>& known,
                 const std::string& what, const char* hint) {
  for (const std::string& name : given) {
    if (std::count(known.begin(), known.end(), name) > 0) continue;
    throw InputError(fmt::format("{} '{}'", what, name), did_you_mean(closest(name, known), hint));
  }
}

std::vector<const bench::BenchDrive*> chosen(const bench::Catalogue& catalogue,
                                             const std::vector<std::string>& only) {
  std::vector<const bench::BenchDrive*> drives;
  std::vector<std::string> names;
  for (const bench::BenchDrive& drive : catalogue.drives) {
    names.push_back(drive.name);
    if (only.empty() || std::count(only.begin(), only.end(), drive.name) > 0) drives.push_back(&drive);
  }
  check_known(only, names, "--only: there is no drive", "'canyon bench list' lists them");
  return drives;
}

/// City, start and trajectory of the user's map and track, as `canyon new` writes them. A track without dates
/// gets a fixed start, so that the drives are the same on any day.
std::string bench_city(const std::vector<std::string>& files, const fs::path& folder) {
  constexpr std::string_view kStart = "start: ", kDate = "2026-06-01";
  if (files.empty()) return {};
  std::string own;
  bool taken = false;
  const NewScenario made = new_scenario(files, (folder / "scenario.yaml").string());
  const bool dated = made.yaml.find("\nduration_s:") != std::string::npos;
  for (const std::string_view line : split(made.yaml, '\n')) {
    if (!line.empty() && line[0] != ' ') {
      taken = false;
      for (const char* key : {"city:", "trajectory:", "start:", "duration_s:"})
        taken = taken || line.starts_with(key);
    }
    if (!taken) continue;
    std::string text(line);
    if (!dated && line.starts_with(kStart)) text.replace(kStart.size(), kDate.size(), kDate);
    own += text + "\n";
    if (line.starts_with("  speed_mps:")) own += "  acceleration_mps2: 2\n";  // inertial sensors need it
  }
  own += "surroundings: auto\n";
  return own;
}

/// `fixed:` of a base with a clear sky for RTK in the user's map: 3 m above the highest corner within 1 km of
/// the drive's begin, else 30 m above the begin.
std::string bench_base(const std::string& yaml, const fs::path& file) {
  constexpr double kReach_m = 1000, kMast_m = 3;
  const ReadyRun ready = make_ready(simulation::parse_scenario(yaml, file), file.string());
  const city::City& city = ready.scene->city;
  const Eigen::Vector3d begin =
      city.frame.local_from_geodetic(ready.simulation->antenna_pose(0, ready.simulation->begin()).position);
  Eigen::Vector3d base = begin + Eigen::Vector3d(0, 0, 30 - kMast_m);
  for (const Eigen::Vector3d& corner : city.mesh.vertices)
    if ((corner - begin).head<2>().norm() < kReach_m && corner.z() > base.z()) base = corner;
  return fmt::format("{{east_m: {:.2f}, north_m: {:.2f}, up_m: {:.2f}}}", base.x(), base.y(),
                     base.z() + kMast_m);
}

/// Receivers by name or file, relative to the working folder; in the scenarios to the drives' folders.
std::vector<bench::BenchReceiver> receivers_of(const MakeArguments& arguments, const fs::path& folder) {
  std::vector<bench::BenchReceiver> receivers;
  for (const std::string& text :
       arguments.receivers.empty() ? std::vector<std::string>{"ublox-m10"} : arguments.receivers) {
    bench::BenchReceiver receiver{text, text, text == "ublox-f9p" ? bench::kTownBase : ""};
    if (simulation::is_profile_path(text)) {
      (void)simulation::read_profile(text);
      receiver.name = fs::path(text).stem().string();
      receiver.profile = Json(fs::proximate(fs::absolute(text), fs::absolute(folder)).string()).dump();
      bench::check_estimate_name(receiver.name, "--receiver");
    } else {
      (void)simulation::built_in_profile(text);
    }
    for (const bench::BenchReceiver& each : receivers)
      if (each.name == receiver.name)
        throw InputError(fmt::format("--receiver: two are named '{}'", receiver.name),
                         "give the files different names");
    receivers.push_back(std::move(receiver));
  }
  return receivers;
}

/// Runs the estimator of 100 lines on each drive without its estimates, if there is a Python with NumPy.
void run_baselines(const fs::path& bench, const std::vector<fs::path>& drives, bool quiet) {
  std::vector<std::vector<std::string>> missing;
  for (const fs::path& drive : drives)
    for (const char* name : {"ekf", "robust"})
      if (const fs::path estimate = drive / (std::string(name) + ".csv"); !fs::exists(estimate)) {
        missing.push_back({"python3", (bench / "ekf.py").string(), drive.string(), estimate.string()});
        if (std::string_view(name) == "robust") missing.back().emplace_back("--robust");
      }
  if (missing.empty()) return;
  if (!fs::exists(bench / "ekf.py")) write_file(bench / "ekf.py", bench::ekf_py);
  if (!is_installed("python3") || run_program({"python3", "-c", "import numpy"}, {"/dev/null", {}}) != kOk) {
    print_warnings(
        {"the baselines ekf and robust are absent: python3 has no NumPy; install python3-numpy, then `canyon "
         "bench score` adds them"});
    return;
  }
  ProgressLine progress("baselines", quiet);
  for (std::size_t i = 0; i < missing.size(); ++i) {
    const fs::path estimate = missing[i][3];
    if (const std::string problem = run_bounded(missing[i], 600); !problem.empty())
      print_warnings({fmt::format("{}: ekf.py: {}", estimate.string(), problem)});
    else
      ResultFiles::note(estimate);
    progress.update(i + 1, missing.size());
  }
}

/// Makes the drives of a bench.
class Maker {
 public:
  explicit Maker(const MakeArguments& arguments)
      : arguments_(arguments), catalogue_(bench::catalogue(arguments.edition)), out_(arguments.out) {}

  int run() {
    const auto drives = chosen(catalogue_, arguments_.only);
    std::vector<bench::BenchReceiver> receivers = receivers_of(arguments_, out_ / "drive");
    ResultFiles files(out_, "bench");
    // Paths in scenarios are relative to the folder of a drive.
    const fs::path first = out_ / name_of(*drives.front(), receivers.front(), 1, receivers.size() > 1);
    fs::create_directories(first);
    own_ = bench_city(arguments_.map, first);
    for (bench::BenchReceiver& receiver : receivers)
      if (!receiver.base.empty() && !own_.empty())
        receiver.base =
            bench_base(bench::scenario_of(catalogue_, *drives.front(), {"", receiver.profile, ""}, 1, own_),
                       first / "scenario.yaml");
    const std::size_t planned = drives.size() * receivers.size() * arguments_.seeds;
    try {
      for (const bench::BenchDrive* drive : drives)
        for (const bench::BenchReceiver& receiver : receivers)
          for (std::size_t seed = 1; seed <= arguments_.seeds; ++seed)
            make(*drive, receiver, seed, receivers.size() > 1);
      write_file(out_ / "ekf.py", bench::ekf_py);
      run_baselines(out_, made_, arguments_.quiet);
    } catch (const Interrupted&) {
      fmt::print(stderr, "canyon: interrupted: {} of {} drives are in {}\n", made_.size(), planned,
                 arguments_.out);
      return kInterrupted;
    }
    if (made_.empty()) throw InputError("--map: no drive can be made from this track", "give a longer track");
    if (const std::size_t removed = files.finish(); removed > 0)
      note(arguments_.quiet,
           fmt::format("removed {} files of an earlier `bench make` from {}", removed, arguments_.out));
    note(arguments_.quiet,
         fmt::format("{} drives in {}. Next: canyon bench run {} -- PROGRAM {{drive}} {{estimate}}",
                     made_.size(), arguments_.out, arguments_.out));
    return kOk;
  }

 private:
  [[nodiscard]] std::string name_of(const bench::BenchDrive& drive, const bench::BenchReceiver& receiver,
                                    std::size_t seed, bool several) const {
    return drive.name + (several ? "-" + receiver.name : "") +
           (arguments_.seeds > 1 ? fmt::format("-{}", seed) : "");
  }

  /// Removes the drives of earlier calls: a bench contains those of one call.
  void retire_others() {
    if (!made_.empty()) return;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(out_, ignored))
      if (fs::exists(entry.path() / "card.yaml", ignored))
        for (const char* file : {"card.yaml", "ekf.csv", "robust.csv"})
          fs::remove(entry.path() / file, ignored);
    fs::remove(out_ / "score.html", ignored);
  }

  void make(const bench::BenchDrive& drive, const bench::BenchReceiver& receiver, std::size_t seed,
            bool several) {
    const std::string name = name_of(drive, receiver, seed, several);
    const fs::path folder = out_ / name;
    const std::string file = (folder / "scenario.yaml").string();
    fs::create_directories(folder);  // paths in the scenario are relative to it
    std::error_code ignored;
    const std::string yaml = bench::scenario_of(catalogue_, drive, receiver, seed, own_);
    const ReadyRun ready = make_ready(simulation::parse_scenario(yaml, file), file);
    const simulation::Simulation& simulation = *ready.simulation;
    const double duration_s = simulation.interval_s() * static_cast<double>(simulation.epoch_count() - 1);
    if (const auto fault_s = bench::first_fault_s(simulation.scenario());
        fault_s.value_or(-1) >= duration_s) {
      print_warnings(
          {fmt::format("{} is left out: its fault begins at {:.0f} s, but the track lasts {:.0f} s", name,
                       *fault_s, duration_s)});
      fs::remove(folder, ignored);  // if it is empty
      return;
    }
    retire_others();
    auto sinks = encoding::make_file_sinks(simulation, folder);
    sinks.push_back(bench::make_drive_sink(simulation, folder));
    std::vector<simulation::EpochSink*> all;
    all.reserve(sinks.size());
    for (const auto& sink : sinks) all.push_back(sink.get());
    RunArguments run_arguments;
    run_arguments.threads = arguments_.threads;
    run_arguments.quiet = arguments_.quiet;
    if (cli::run(simulation, all, run_arguments, drive.name.c_str()).interrupted) throw Interrupted();
    write_file(file, yaml);
    bench::DriveCard card{catalogue_.bench, drive, receiver.name, {}};
    for (const bench::BenchDrive& other : catalogue_.drives)
      if (drive.has_fault() && !other.has_fault() && other.town == drive.town && other.route == drive.route)
        card.without_fault = name_of(other, receiver, seed, several);
    bench::write_card(simulation, card, folder);
    made_.push_back(folder);
  }

  const MakeArguments& arguments_;
  const bench::Catalogue& catalogue_;
  fs::path out_;
  std::string own_;
  std::vector<fs::path> made_;
};

struct UserEstimate {
  std::string name, file;           ///< file: {drive} is replaced by the drive's name
  fs::path folder;                  ///< of the file, without replacement; empty: the working folder
  std::vector<std::string> inputs;  ///< data that it reads; empty: not known
  std::map<std::string, std::string> failures;  ///< by drive: the reason why there is no estimate
};

std::vector<UserEstimate> user_estimates(const ScoreArguments& arguments) {
  std::vector<UserEstimate> estimates;
  for (const std::string& each : arguments.estimates) {
    const auto [name, file] = bench::named_file(each, "--estimate");
    estimates.push_back({name, file, {}, {}, {}});
  }
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    if (std::count(kBaselines.begin(), kBaselines.end(), estimates[i].name) > 0)
      throw InputError(fmt::format("'{}' is the name of a baseline", estimates[i].name), "give another name");
    for (std::size_t j = 0; j < i; ++j)
      if (estimates[i].name == estimates[j].name)
        throw InputError(fmt::format("two estimates are named '{}'", estimates[i].name),
                         "give each its own name");
  }
  const std::vector<std::string> known(std::begin(bench::kInputs), std::end(bench::kInputs));
  for (const std::string& each : arguments.reads) {
    const std::size_t equals = each.find('=');
    const std::string name = equals == std::string::npos ? "" : each.substr(0, equals);
    std::vector<std::string> inputs;
    for (const std::string_view input :
         split(equals == std::string::npos ? each : each.substr(equals + 1), ','))
      inputs.emplace_back(trim(input));
    check_known(inputs, known, "--reads: there is no input", "give fixes, raw, imu, wheels");
    bool found = false;
    for (UserEstimate& estimate : estimates)
      if (name.empty() || name == estimate.name) estimate.inputs = inputs, found = true;
    if (!found)
      throw InputError(fmt::format("--reads: there is no estimate '{}'", name),
                       "give --estimate " + name + "=FILE");
  }
  return estimates;
}

/// Tracks of a drive by the name of their estimate, and reasons why a user's is absent.
struct DriveTracks {
  bench::DriveFolder drive;
  std::map<std::string, bench::Track> tracks;
  std::map<std::string, std::string> failures;
};

/// @param problem of the drive's folder; then there are only failures
DriveTracks read_tracks(const fs::path& folder, const std::vector<UserEstimate>& estimates,
                        std::string& problem) {
  DriveTracks all;
  all.drive.name = folder.filename().string();
  try {
    all.drive = bench::read_drive(folder);
  } catch (const InputError& error) {
    problem = error.what();
    for (const UserEstimate& each : estimates) all.failures[each.name] = problem;
    return all;
  }
  all.tracks["fixes"] = all.drive.fixes;
  const auto read = [&](const std::string& name, const fs::path& file) -> std::string {
    bench::Track& track = all.tracks[name];
    if (!fs::exists(file)) return fmt::format("there is no {}", file.string());
    try {
      track = bench::read_estimate(file, all.drive);
      return track.time_s.empty() ? file.string() + " has no position" : "";
    } catch (const InputError& error) {
      return error.what();
    }
  };
  for (const char* baseline : {"single", "ekf", "robust"}) {
    const fs::path file = folder / (std::string(baseline) + ".csv");
    if (const std::string failure = read(baseline, file); !failure.empty() && fs::exists(file))
      print_warnings({failure});
  }
  for (const UserEstimate& each : estimates) {
    const auto known = each.failures.find(all.drive.name);
    std::string failure = known == each.failures.end() ? "" : known->second;
    if (!failure.empty())
      all.tracks[each.name] = {};
    else
      failure = read(each.name, each.folder / bench::filled(each.file, {{"drive", all.drive.name}}));
    if (!failure.empty()) all.failures[each.name] = failure;
  }
  return all;
}

std::vector<std::string> drive_names(const std::vector<fs::path>& folders) {
  std::vector<std::string> names(folders.size());
  std::transform(folders.begin(), folders.end(), names.begin(),
                 [](const fs::path& f) { return f.filename(); });
  return names;
}

int score_estimates(const ScoreArguments& arguments, const std::vector<UserEstimate>& estimates) {
  const std::vector<fs::path> folders = bench::drives_in(arguments.bench);
  bench::LimitsFile limits;
  if (!arguments.limits.empty()) limits = bench::read_limits(arguments.limits, drive_names(folders));
  run_baselines(arguments.bench, folders, arguments.quiet);
  std::vector<DriveTracks> all;
  int failed = 0;
  ProgressLine progress("scoring", arguments.quiet);
  for (const fs::path& folder : folders) {
    std::string problem;
    all.push_back(read_tracks(folder, estimates, problem));
    if (!problem.empty())
      print_warnings({fmt::format("{} is not scored: {}", all.back().drive.name, problem)}), ++failed;
    progress.update(all.size(), folders.size());
  }
  const auto inputs_of = [&](const std::string& name) {
    for (const UserEstimate& each : estimates)
      if (each.name == name) return each.inputs;
    return name == "fixes" || name == "single" ? std::vector<std::string>{"fixes"}
                                               : std::vector<std::string>{"fixes", "imu", "wheels"};
  };
  // Drives without faults first: their errors define when estimates of the other drives have recovered.
  std::map<std::pair<std::string, std::string>, bench::Score> scores;
  for (const bool faulty : {false, true}) {
    for (const DriveTracks& each : all) {
      if (each.drive.without_fault.empty() == faulty) continue;
      for (const auto& [name, track] : each.tracks) {
        bench::EstimateFacts facts{inputs_of(name), {}};
        const auto other = scores.find({each.drive.without_fault, name});
        if (other != scores.end() && other->second.availability > 0)
          facts.without_fault_p95_m = other->second.p95_m;
        scores[{each.drive.name, name}] = bench::score(each.drive, track, limits.recovered_m, facts);
      }
    }
  }
  std::vector<bench::Result> results;
  std::vector<bench::DriveFolder> drives;
  std::map<std::string, std::map<std::string, bench::Track>> tracks;
  for (const DriveTracks& each : all) {
    std::set<std::string> names;
    for (const auto& [name, track] : each.tracks) names.insert(name);
    for (const auto& [name, failure] : each.failures) names.insert(name);
    for (const std::string& name : names) {
      const auto score = scores.find({each.drive.name, name});
      bench::Result& result =
          results.emplace_back(bench::Result{each.drive.name,
                                             name,
                                             each.drive.edition,
                                             score == scores.end() ? bench::Score() : score->second,
                                             {}});
      const auto failure = each.failures.find(name);
      if (failure != each.failures.end())
        result.violations = {failure->second};
      else if (std::count(kBaselines.begin(), kBaselines.end(), name) == 0)
        result.violations = bench::violations(each.drive.name, result.score, limits.limits);
    }
    if (each.tracks.empty()) continue;
    drives.push_back(each.drive);
    tracks[each.drive.name] = each.tracks;
  }
  if (!arguments.quiet && arguments.json != "-") {
    std::vector<TextRow> rows;
    rows.reserve(results.size());
    for (const bench::Result& each : results) rows.push_back(bench::result_cells(each));
    fmt::print("{}", text_table(bench::result_head(), rows, {2}));
  }
  const std::string html =
      arguments.html.empty() ? (fs::path(arguments.bench) / "score.html").string() : arguments.html;
  write_file(html, bench::page(results, drives, tracks));
  if (arguments.json == "-")
    fmt::print("{}", bench::to_json(results));
  else if (!arguments.json.empty())
    write_file(arguments.json, bench::to_json(results));
  if (!arguments.junit.empty()) write_file(arguments.junit, bench::to_junit(results));
  note(arguments.quiet, "pictures of all drives: " + html);
  for (const bench::Result& each : results) {
    for (const std::string& violation : each.violations)
      fmt::print(stderr, "{}, {}: {}\n", each.drive, each.estimate, violation);
    failed += each.violations.empty() ? 0 : 1;
  }
  if (failed > 0) note(arguments.quiet, fmt::format("{} of {} scores fail", failed, results.size()));
  return failed > 0 ? kFailure : kOk;
}

/// Of interrupted commands, whose written files are kept.
constexpr const char* kUndone = "nothing was scored";

int score_bench(const ScoreArguments& arguments) {
  return unless_interrupted([&] { return score_estimates(arguments, user_estimates(arguments)); }, kUndone);
}

int run_all(const ScoreArguments& given) {
  ScoreArguments arguments = given;
  for (const char* word : {"{drive}", "{estimate}"}) {
    if (std::none_of(arguments.command.begin(), arguments.command.end(),
                     [&](const std::string& each) { return each.find(word) != std::string::npos; }))
      throw InputError(arguments.command.empty() ? std::string("there is no program to run")
                                                 : fmt::format("the program's arguments lack {}", word),
                       "give it after --: -- python3 my_ekf.py {drive} {estimate}");
  }
  const auto folders = bench::drives_in(arguments.bench);
  bench::check_estimate_name(arguments.command_estimate, "--name");
  const fs::path files = fs::path(arguments.bench) / "estimates" / arguments.command_estimate;
  arguments.estimates.push_back(arguments.command_estimate + "={drive}.csv");
  std::vector<UserEstimate> estimates = user_estimates(arguments);
  estimates.back().folder = files;
  if (!arguments.limits.empty()) (void)bench::read_limits(arguments.limits, drive_names(folders));
  fs::create_directories(files);
  {
    ProgressLine progress("estimating", arguments.quiet);
    for (std::size_t i = 0; i < folders.size(); ++i) {
      const std::string drive = folders[i].filename().string();
      const fs::path estimate = files / (drive + ".csv");
      fs::remove_all(estimate);
      std::vector<std::string> words = arguments.command;
      for (std::string& word : words)
        word = bench::filled(word, {{"drive", folders[i].string()}, {"estimate", estimate.string()}});
      std::string failure = run_bounded(words, arguments.timeout_s);
      if (failure.empty() && !fs::exists(estimate)) failure = "the program wrote no estimate";
      if (!failure.empty()) fs::remove_all(estimate);
      if (!failure.empty()) estimates.back().failures[drive] = failure;
      progress.update(i + 1, folders.size());
    }
  }
  return score_estimates(arguments, estimates);
}

int run_run(const ScoreArguments& arguments) {
  return unless_interrupted([&] { return run_all(arguments); }, kUndone);
}

void add_score_options(Command& command, ScoreArguments& arguments) {
  command.add_option("bench", arguments.bench, "DIR", "folder of `canyon bench make`").required();
  command
      .add_option("--estimate", arguments.estimates, "NAME=FILE",
                  "an estimate, CSV or TUM; {drive} is replaced by the name of the drive; may be repeated")
      .repeated();
  command
      .add_option("--reads", arguments.reads, "[NAME=]LIST",
                  "data that the estimates read, fixes, raw, imu, wheels: other faults are not scored (all)")
      .repeated();
  command.add_option("--limits", arguments.limits, "FILE", "YAML of limits; exit code 1 if one is exceeded");
  command.add_option("--json", arguments.json, "FILE", "scores as JSON; -: to standard output, alone")
      .writes();
  command.add_option("--junit", arguments.junit, "FILE", "a test case for each drive, for CI").writes();
  command.add_option("--html", arguments.html, "FILE", "page with pictures (DIR/score.html)").writes();
  command.add_flag("--quiet", arguments.quiet, "print warnings and errors only");
}

}  // namespace

void add_bench(Command& app) {
  Command& bench = app.add_command("bench", "run an estimator on drives with GNSS failures, and score it");
  Command& list = bench.add_command("list", "list the drives");
  MakeArguments& listed = list.run_with(run_list);
  const std::string editions = fmt::format("edition of the drives ({})", bench::kEdition);
  list.add_option("--edition", listed.edition, "N", editions).within(1, bench::kEdition);

  Command& make = bench.add_command("make", "simulate drives: truth, fixes, IMU, wheels, raw data, events");
  MakeArguments& arguments =
      make.run_with<MakeArguments>([](const MakeArguments& of) { return Maker(of).run(); });
  make.add_option("out", arguments.out, "DIR", "folder of the bench").required();
  make.add_option("--only", arguments.only, "NAME", "drives (all)");
  make.add_option("--receiver", arguments.receivers, "PROFILE",
                  "receivers, by name or file (ublox-m10); ublox-f9p has a base for RTK");
  make.add_option("--seeds", arguments.seeds, "N", "realizations of each drive (1)").within(1, 100);
  make.add_option("--map", arguments.map, "FILE", "a map, and a track, instead of the synthetic towns");
  make.add_option("--edition", arguments.edition, "N", editions).within(1, bench::kEdition);
  add_threads(make, arguments.threads);
  make.add_flag("--quiet", arguments.quiet, "print warnings and errors only");
  make.footer = "docs/bench.md describes the files of a drive.";

  Command& run = bench.add_command("run", "run a program on each drive, and score it");
  ScoreArguments& run_arguments = run.run_with(run_run);
  add_score_options(run, run_arguments);
  run.add_option("--name", run_arguments.command_estimate, "NAME", "name of the program's estimate (mine)");
  run.add_option("--timeout", run_arguments.timeout_s, "S", "time limit of the program for a drive [s] (600)")
      .within(0.1, 1e6);
  run.add_option("command", run_arguments.command, "PROGRAM",
                 "after --: the program; {drive} is the drive's folder, {estimate} the file to write");
  run.footer = "Example: canyon bench run out/bench -- python3 my_ekf.py {drive} {estimate}";

  Command& score = bench.add_command("score", "score estimates, next to the fixes and two small filters");
  add_score_options(score, score.run_with(score_bench));
}

}  // namespace canyon::cli
