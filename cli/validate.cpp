#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "canyon/analysis/calibration/calibrate.hpp"
#include "canyon/analysis/validation/comparison.hpp"
#include "canyon/analysis/validation/comparison_view.hpp"
#include "canyon/analysis/validation/ensemble.hpp"
#include "canyon/analysis/validation/metrics.hpp"
#include "canyon/analysis/validation/metrics_text.hpp"
#include "canyon/analysis/validation/recording_table.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/unknowns/unknowns.hpp"
#include "cli/commands.hpp"
#include "cli/progress.hpp"
#include "cli/recorded_drive.hpp"

namespace canyon::cli {
namespace {

/// Samples of unknowns have these arguments as well.
struct EnsembleArguments : DriveArguments {
  std::optional<int> samples;
  std::string known;
  bool forget_unknowns = false;
};

using FixedUnknowns = std::vector<unknowns::Unknown>;
using ProgressCallback = std::function<void(std::size_t, std::size_t)>;

bool is_known(const FixedUnknowns& known, unknowns::Unknown unknown) {
  return std::find(known.begin(), known.end(), unknown) != known.end();
}

/// A recording, simulated as set and with samples of unknowns, only at the epochs of the metrics.
class EnsembleDrive : public RecordedDrive {
 public:
  EnsembleDrive(const EnsembleArguments& arguments, const validation::ListedRecording& recording, bool listed)
      : RecordedDrive(arguments, recording, listed), arguments_(arguments) {
    if (arguments.forget_unknowns) unknowns::forget(scenario_);
  }

  void start(const FixedUnknowns& known) {
    load();
    recording_ = calibration::part_of(recording_, part_.first, part_.count);
    add_map(known);
    row_.name = prefix_.empty() ? scenario_.file.stem().string() : recorded_.name;
    row_.unknowns = unknowns::priors_of(scenario_, known);
    simulate_point();
  }

  /// @param report_progress called with the number of epochs
  void draw(const unknowns::UnknownSamples& samples, std::size_t k, const ProgressCallback& report_progress) {
    simulation::Scenario scenario = scenario_;
    scenario.seed += k + 1;
    validation::EnsembleRow::EnsembleSample draw;
    draw.values = samples.apply(k, scenario);
    const validation::Registration position = registration(scenario.city.georeference, scenario.seed);
    const auto environment = sampled_environment(scenario);
    compare_.progress = report_progress;
    const validation::Comparison run =
        simulate(scenario.receivers.front(), *environment, position, scenario.seed);
    draw.key_metrics = key_metrics({&run, 1});
    row_.samples.push_back(std::move(draw));
  }

  [[nodiscard]] const validation::EnsembleRow& row() const { return row_; }

 private:
  /// The uncertainty of the map's position is that of its alignment, unless it should stay unknown.
  void add_map(const FixedUnknowns& known) {
    simulation::Georeference& georeference = scenario_.city.georeference;
    if (is_known(known, unknowns::Unknown::Map))
      georeference = {};
    else if (alignment_ && georeference.sigma_m == 0 && !arguments_.forget_unknowns)
      georeference.sigma_m = std::hypot(alignment_->sigma_east_m, alignment_->sigma_north_m) / std::sqrt(2.0);
  }

  void simulate_point() {
    ProgressLine progress(fmt::format("{}simulating as it is", prefix_), arguments_.quiet);
    compare_.progress = progress_of(progress);
    point_ = simulate(scenario_.receivers.front());
    row_.part = validation::describe_part(point_, 0, part_.count, part_.name);
    row_.point = key_metrics({});
  }

  /// Key metrics of these runs, with the classes of satellites of the original city.
  [[nodiscard]] std::vector<validation::KeyMetric> key_metrics(
      std::span<const validation::Comparison> runs) const {
    validation::MetricOptions options;
    options.resamples = 0;
    return validation::key_metrics(validation::metrics(point_, 0, part_.count, "", options, runs));
  }

  const EnsembleArguments& arguments_;
  validation::Comparison point_;
  validation::EnsembleRow row_;
};

using Drives = std::vector<std::unique_ptr<EnsembleDrive>>;

/// Samples of all drives, one after the other.
void draw_all(const EnsembleArguments& arguments, const unknowns::UnknownSamples& samples,
              const Drives& drives) {
  const std::atomic<bool>& stop = catch_interrupts();
  ProgressLine progress("sampling unknowns", arguments.quiet, "runs");
  const std::size_t total = samples.size() * drives.size();
  progress.update(0, total);
  const ProgressCallback report_progress = [&stop](std::size_t, std::size_t) {
    if (stop.load()) throw Interrupted{};
  };
  std::size_t done = 0;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    for (const auto& drive : drives) {
      drive->draw(samples, k, report_progress);
      progress.update(++done, total);
    }
  }
}

void write_ensemble(const EnsembleArguments& arguments, const Drives& drives) {
  std::vector<validation::EnsembleRow> rows;
  for (const auto& drive : drives) rows.push_back(drive->row());
  if (write_results(arguments, [&rows] { return validation::ensemble_json(rows); })) {
    fmt::print("\n{}", validation::ensemble_text(rows));
    warn_of_few_samples(static_cast<std::size_t>(*arguments.samples), "--ensemble");
  }
}

/// Simulates each recording with samples of what its scenario leaves open, and writes the intervals of its
/// metrics next to the recorded ones. Ctrl-C ends it without results.
int run_ensemble(const EnsembleArguments& arguments) {
  return unless_interrupted([&] {
    const FixedUnknowns known = unknowns::unknowns_of(arguments.known);
    const bool listed = validation::is_recording_list(arguments.scenario);
    const Drives drives = drives_of<EnsembleDrive>(arguments, recordings_of(arguments, listed), listed);
    for (const auto& drive : drives) drive->start(known);
    const auto count = static_cast<std::size_t>(*arguments.samples);
    draw_all(arguments, unknowns::UnknownSamples(arguments.seed.value_or(1), count, known), drives);
    write_ensemble(arguments, drives);
    return kOk;
  });
}

struct ValidateArguments : EnsembleArguments {
  std::string view, models;
  bool ladder = false;
  std::optional<int> runs;
  int seeds = 1;
};

/// Validates one recording. Keeps its results until everything is written at the end.
class RecordingValidator : public RecordedDrive {
 public:
  /// Checks that need no city, before one is loaded. @param listed among others, by its name
  RecordingValidator(const ValidateArguments& arguments, const validation::ListedRecording& recording,
                     bool listed)
      : RecordedDrive(arguments, recording, listed), arguments_(arguments) {
    choose_models();
  }

  void run() {
    load();
    compare();
  }

  void write_view(const std::filesystem::path& folder) const {
    validation::ComparisonInput view;
    view.title =
        (prefix_.empty() ? scenario_.file.stem().string() : recorded_.name) + ", recorded and simulated";
    view.environment = environment_.get();
    view.comparison = &own_;
    view.first = part_.first;
    view.count = part_.count;
    view.elevation_mask_deg = geodesy::degrees(scenario_.receivers.front().options.fix.elevation_mask_rad);
    validation::write_comparison(view, folder);
  }
  [[nodiscard]] std::string json() const {
    return validation::to_json(metrics_,
                               alignment_ ? std::optional(validation::to_json(*alignment_)) : std::nullopt);
  }
  /// The metrics for a terminal.
  [[nodiscard]] std::string text() const {
    return (alignment_ ? alignment_text() + "\n" : "") + validation::to_text(metrics_.front()) +
           (several_models() ? "\n" + models_table() : "") + "\n" + validation::score_card({row()});
  }
  [[nodiscard]] bool several_models() const { return metrics_.size() > 1; }
  [[nodiscard]] std::string models_table() const { return validation::models_table(metrics_); }

  /// Epochs and runs of the metrics.
  [[nodiscard]] validation::PooledPart part() const {
    return {&own_, part_.first, part_.count, runs_of_reported_};
  }
  /// The row in a table of several recordings.
  [[nodiscard]] validation::RecordingRow row() const {
    validation::RecordingRow row = row_of(prefix_.empty() ? "simulated (recorded)" : recorded_.name,
                                          metrics_.front(), own_, runs_of_reported_);
    row.metrics_json = json();
    return row;
  }

 private:
  void choose_models() {
    const simulation::ReceiverConfig& receiver = scenario_.receivers.front();
    const simulation::Georeference& georeference = scenario_.city.georeference;
    const bool uncertain = georeference.sigma_m > 0 || georeference.heading_sigma_rad > 0;
    if (arguments_.runs.value_or(1) > 1 && !uncertain) {
      throw InputError(
          prefix_ + "--runs without an uncertainty of the city's position: every run would be the same",
          "add city: {georeference: {sigma_m: 3}} to the scenario");
    }
    runs_ = arguments_.runs.value_or(10);
    const std::string sampled =
        uncertain ? fmt::format(", {} cities sampled within {:g} m", runs_, georeference.sigma_m) : "";
    models_.push_back(
        {"", fmt::format("{} (the scenario's{})", receiver.options.name, sampled), receiver, uncertain});
    std::vector<validation::Model> more;
    if (arguments_.ladder) {
      more = validation::cumulative_models(receiver);
    } else if (!arguments_.models.empty()) {
      std::vector<std::string> keys;
      for (const std::string_view key : split(arguments_.models, ',')) keys.emplace_back(trim(key));
      more = validation::models_of(receiver, keys);
    }
    models_.insert(models_.end(), more.begin(), more.end());
  }

  void compare() {
    for (const validation::Model& model : models_) {
      ProgressLine progress(fmt::format("{}simulating: {}", prefix_, model.name), arguments_.quiet);
      compare_.name = model.name;
      const int moved = model.moved_city ? runs_ : 0;
      int done_runs = 0;
      const auto report_progress = progress_of(progress);
      compare_.progress = [&](std::size_t done, std::size_t total) {
        report_progress(static_cast<std::size_t>(done_runs) * total + done,
                        static_cast<std::size_t>(moved + 1) * total);
      };
      validation::Comparison comparison = simulate(model.receiver);
      std::vector<validation::Comparison> runs;
      for (int run = 0; run < moved; ++run) {
        ++done_runs;
        const std::uint64_t seed = scenario_.seed + static_cast<std::uint64_t>(run);
        runs.push_back(
            simulate(model.receiver, *environment_, registration(scenario_.city.georeference, seed), seed));
      }
      const bool own = metrics_.empty();
      validation::ModelMetrics& f = metrics_.emplace_back(metrics_of(comparison, part_, runs));
      if (!own) continue;
      if (alignment_) aligned_by_ = validation::describe_part(comparison, 0, first_part_.count, aligned_by_);
      add_reported_fixes(f, comparison);
      own_ = std::move(comparison);
      runs_of_reported_ = std::move(runs);
    }
  }

  const ValidateArguments& arguments_;
  std::vector<validation::Model> models_;
  int runs_ = 1;  ///< of models with a moved city
  std::vector<validation::ModelMetrics> metrics_;
  validation::Comparison own_;
  std::vector<validation::Comparison> runs_of_reported_;
};

using Judges = std::vector<std::unique_ptr<RecordingValidator>>;

/// A row for each class of several recordings, from the observations of all of them.
std::vector<validation::RecordingRow> pooled_rows(const Judges& judges) {
  std::vector<validation::RecordingRow> rows;
  for (const auto& one : judges) {
    const std::string& of = one->recorded().receiver_class;
    const bool done =
        std::any_of(rows.begin(), rows.end(), [&of](const auto& row) { return row.receiver_class == of; });
    if (of.empty() || done) continue;
    validation::RecordingRow row;
    row.name = "all " + of;
    row.receiver_class = of;
    std::vector<validation::PooledPart> parts;
    for (const auto& judge : judges) {
      if (judge->recorded().receiver_class != of) continue;
      row.pooled.push_back(judge->recorded().name);
      parts.push_back(judge->part());
    }
    if (parts.size() < 2) continue;
    const validation::Pooled all = validation::pool(parts);
    const std::size_t count = all.comparison.epochs.size();
    validation::MetricOptions options;
    options.resamples = 0;
    row.key_metrics =
        validation::key_metrics(validation::metrics(all.comparison, 0, count, "", options, all.runs));
    options.resamples = kResamples;
    validation::add_intervals(row.key_metrics, all.comparison, 0, count, options, all.runs);
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<validation::RecordingRow> rows_of(const Judges& judges) {
  std::vector<validation::RecordingRow> rows;
  for (const auto& judge : judges) rows.push_back(judge->row());
  return rows;
}

/// The scores of further seeds after those of the first; empty if there are none.
std::string scores_by_seed(const ValidateArguments& arguments, const Judges& first, bool listed) {
  if (arguments.seeds < 2) return {};
  std::vector<validation::SeedRows> seeds{{*arguments.seed, rows_of(first)}};
  for (int k = 1; k < arguments.seeds; ++k) {
    ValidateArguments again = arguments;
    again.seed = *arguments.seed + static_cast<std::uint64_t>(k);
    again.ladder = false;
    again.models.clear();
    note(arguments.quiet, fmt::format("seed        {} ({} of {})", *again.seed, k + 1, arguments.seeds));
    const Judges judges = drives_of<RecordingValidator>(again, recordings_of(again, listed), listed);
    for (const auto& judge : judges) judge->run();
    seeds.push_back({*again.seed, rows_of(judges)});
  }
  return "\n" + validation::seed_scores(seeds);
}

/// Writes everything at the end, so that an interrupted run leaves no files.
void write(const ValidateArguments& arguments, const Judges& judges, bool listed) {
  const RecordingValidator& one = *judges.front();
  const std::string by_seed = scores_by_seed(arguments, judges, listed);
  std::vector<validation::RecordingRow> rows;
  if (listed) {
    rows = rows_of(judges);
    for (validation::RecordingRow& row : pooled_rows(judges)) rows.push_back(std::move(row));
  }
  if (!arguments.view.empty()) {
    const std::filesystem::path folder = arguments.view;
    for (const auto& judge : judges) judge->write_view(listed ? folder / judge->recorded().name : folder);
    cli::note(arguments.quiet, fmt::format("view in {}", arguments.view));
  }
  const auto json = [&] { return listed ? validation::to_json(rows) : one.json(); };
  if (!write_results(arguments, json)) return;
  if (!listed) {
    fmt::print("{}{}", one.text(), by_seed);
    return;
  }
  for (const auto& judge : judges) fmt::print("{}", judge->alignment_line());
  fmt::print("\n{}\n{}{}", validation::to_text(rows), validation::score_card(rows), by_seed);
  for (const auto& judge : judges)
    if (judge->several_models())
      fmt::print("\nModels, {}:\n\n{}", judge->recorded().name, judge->models_table());
}

int run_validate(const ValidateArguments& given) {
  if (given.samples) return run_ensemble(given);
  ValidateArguments arguments = given;
  if (arguments.seeds > 1 && !arguments.seed) arguments.seed = 1;
  return unless_interrupted([&] {
    const bool listed = validation::is_recording_list(arguments.scenario);
    const Judges judges = drives_of<RecordingValidator>(arguments, recordings_of(arguments, listed), listed);
    std::optional<ResultFiles> view;
    if (!arguments.view.empty()) view.emplace(arguments.view, "validate");
    for (const auto& judge : judges) judge->run();
    write(arguments, judges, listed);
    return kOk;
  });
}

}  // namespace

void add_validate(Command& app) {
  Command& command = app.add_command("validate", "compare a scenario with recordings of a real receiver");
  ValidateArguments& arguments = command.run_with(run_validate);
  add_drive_options(command, arguments);
  command
      .add_option("--part", arguments.part, "PART",
                  "part for the metrics: first (used for the alignment), rest or all (the rest with --align, "
                  "else all)")
      .one_of({"first", "rest", "all"});
  command.add_flag("--all-satellites", arguments.all_satellites,
                   "keep satellites that the recording never tracks although they are above 15 deg in clear "
                   "view for two minutes or longer");
  command.add_option("--models", arguments.models, "LIST",
                     "models in addition to the scenario's: mirror, specular, second, tracking, diffuse, "
                     "ground, shadowing, diffraction");
  command
      .add_flag("--cumulative-models", arguments.ladder,
                "all of these models, each added to the previous one")
      .formerly("--ladder")
      .excludes("--models");
  command.add_option("--view", arguments.view, "DIR",
                     "write a view of the comparison, in DIR/NAME for each recording of a list: 'canyon view "
                     "DIR' opens it");
  command
      .add_option("--json", arguments.json, "FILE", "write the metrics as JSON; -: to standard output, alone")
      .writes();
  command
      .add_option("--runs", arguments.runs, "N",
                  "number of cities sampled by the scenario's city.georeference; their simulated values are "
                  "pooled (10)")
      .within(1, 1000);
  command
      .add_option(
          "--seeds", arguments.seeds, "N",
          "simulate N seeds from --seed (1) on and add their scores; all other metrics are of the first seed")
      .within(1, 1000);
  command
      .add_option(
          "--ensemble", arguments.samples, "N",
          "simulate each recording N times with samples of what its scenario leaves open (level of the "
          "installation, obstacles, facades, position of the map, seed), and print intervals of the metrics")
      .within(2, 1000)
      .excludes("--seeds")
      .excludes("--runs")
      .excludes("--models")
      .excludes("--cumulative-models")
      .excludes("--view");
  command
      .add_flag("--forget-unknowns", arguments.forget_unknowns,
                "ignore the scenarios' settings of installation, surroundings, obstacles and facades")
      .formerly("--unsaid")
      .needs("--ensemble");
  add_fixed_unknowns(command, arguments.known).needs("--ensemble");
  command.add_flag("--quiet", arguments.quiet, "print warnings and errors only (and the output of --json -)");
  command.footer =
      "The error of each recorded pseudorange follows from the true positions; the city's rays show which\n"
      "satellites were in line of sight. docs/methods.md explains the metrics. A list of recordings is a "
      "YAML\n"
      "file; recordings of one class are also pooled:\n"
      "  recordings: [{name: a, scenario: a.yaml, obs: a.obs, class: mass market, align: true}, ...]";
}

}  // namespace canyon::cli
