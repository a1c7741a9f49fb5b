#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>

#include "canyon/base/input_error.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/rinex/observation_reader.hpp"
#include "canyon/simulation/georeference.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/profile.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/validation/alignment.hpp"
#include "canyon/validation/comparison.hpp"
#include "canyon/validation/figures.hpp"
#include "canyon/validation/models.hpp"
#include "canyon/validation/recording_list.hpp"
#include "canyon/validation/recording_table.hpp"
#include "canyon/validation/report/report.hpp"
#include "cli/commands.hpp"
#include "cli/field_option.hpp"
#include "cli/interrupt.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {
namespace {

/// A part needs this many epochs to be aligned by or judged.
constexpr std::size_t kFewestEpochs = 10;
/// Below this mean AUC the city and the recording have little to do with each other: 0.5 is chance, 0.88 what
/// a city of OpenStreetMap outlines reached (docs/accuracy.md).
constexpr double kTellingScore = 0.7;

/// Blocks drawn anew for the intervals of a table of several recordings, each with all of its figures.
constexpr int kResamples = 200;

struct Arguments {
  std::string scenario, obs, truth, format, old_format, nmea, part, report, models, json, markdown;
  bool align = false, ladder = false, no_atmosphere = false, all_satellites = false, quiet = false;
  std::optional<double> split;
  validation::AlignOptions alignment;
  std::optional<std::uint64_t> seed;
  std::optional<int> runs;
  int threads = 0;
};

/// Ctrl-C: thrown by progress callbacks, so that nothing half done is written.
struct Interrupted {};

std::string share_name(double split) {
  if (split == 0.5) return "half";
  return fmt::format("{:.0f} %", 100 * split);
}

/// What the command line says of a recording, or of all that a list does not say otherwise of.
validation::ListedRecording with_options(validation::ListedRecording recording, const Arguments& arguments) {
  recording.align = recording.align || arguments.align;
  recording.align_heading = recording.align_heading || arguments.alignment.heading;
  if (arguments.split) recording.split = arguments.split;
  return recording;
}

void note(const Arguments& arguments, const std::string& text) {
  if (arguments.quiet) return;
  std::fflush(stdout);
  fmt::print(stderr, "{}\n", text);
}

/// One recording, judged. Keeps all that is told of it: everything is written at the end.
class Judge {
 public:
  /// Checks that need no city, before one is loaded. @param listed among others, by its name
  Judge(const Arguments& arguments, const validation::ListedRecording& recording, bool listed)
      : arguments_(arguments),
        recorded_(with_options(recording, arguments)),
        prefix_(listed ? recording.name + ": " : ""),
        stop_(catch_interrupts()),
        scenario_(read_scenario()) {
    check();
  }

  void run() {
    load();
    choose_parts();
    if (recorded_.align) align();
    compare();
  }

  void write_report(const std::filesystem::path& folder) const {
    validation::ReportInput report;
    report.title = prefix_.empty() ? scenario_.file.stem().string() : recorded_.name;
    report.city = &environment_->city();
    report.environment = environment_.get();
    report.comparison = &own_;
    report.first = first_;
    report.count = count_;
    report.models = figures_;
    report.alignment = alignment_;
    report.notes = notes_;
    validation::write_report(folder, report);
  }
  [[nodiscard]] std::string json() const {
    return validation::to_json(figures_,
                               alignment_ ? std::optional(validation::to_json(*alignment_)) : std::nullopt);
  }
  /// What terminals are told of one recording.
  [[nodiscard]] std::string text() const {
    return (alignment_ ? alignment_text() + "\n" : "") + validation::to_text(figures_.front()) +
           (several_models() ? "\n" + markdown() : "");
  }
  [[nodiscard]] bool several_models() const { return figures_.size() > 1; }
  [[nodiscard]] std::string markdown() const { return validation::to_markdown(figures_); }
  [[nodiscard]] std::string alignment_line() const {
    return alignment_ ? prefix_ + alignment_text() : std::string();
  }

  [[nodiscard]] const validation::ListedRecording& recorded() const { return recorded_; }
  /// Epochs and runs that the figures are of.
  [[nodiscard]] validation::PooledPart part() const { return {&own_, first_, count_, runs_of_own_}; }
  /// In a table of several.
  [[nodiscard]] validation::RecordingRow row() const {
    const validation::Figures& own = figures_.front();
    validation::RecordingRow row;
    row.name = recorded_.name;
    row.receiver_class = recorded_.receiver_class;
    row.headlines = validation::headlines(own);
    validation::FigureOptions options;
    options.resamples = kResamples;
    validation::add_intervals(row.headlines, own_, first_, count_, options, runs_of_own_);
    if (!arguments_.report.empty()) row.report = recorded_.name + "/report.html";
    row.part = own.part;
    row.never_tracked = validation::never_tracked_text(own);
    row.figures_json = json();
    return row;
  }

 private:
  [[nodiscard]] simulation::Scenario read_scenario() const {
    simulation::Scenario scenario = recorded_.profile.empty() ? simulation::read_scenario(*recorded_.scenario)
                                                              : simulation::read_scenario_with_profile(
                                                                    *recorded_.scenario, recorded_.profile);
    if (arguments_.seed) scenario.seed = *arguments_.seed;
    return scenario;
  }

  void note(const std::string& text) const { cli::note(arguments_, prefix_ + text); }
  void warn(const std::vector<std::string>& lines) {
    for (const std::string& line : lines) {
      if (!arguments_.quiet) print_warnings({prefix_ + line});
      notes_.push_back("warning: " + line);
    }
  }
  [[nodiscard]] std::function<void(std::size_t, std::size_t)> progress_of(Progress& progress) const {
    return [this, &progress](std::size_t done, std::size_t total) {
      if (stop_.load()) throw Interrupted{};
      progress.update(done, total);
    };
  }

  void check() {
    warn(scenario_.warnings);
    format_ = recorded_.truth_format;
    if (recorded_.truth) {
      truth_ = *recorded_.truth;
    } else {
      if (!scenario_.trajectory.file) {
        throw InputError(prefix_ + "--truth is missing, and the scenario's trajectory is no file",
                         "give the file of true positions");
      }
      truth_ = *scenario_.trajectory.file;
    }
    if (format_.empty()) format_ = scenario_.trajectory.file ? scenario_.trajectory.format : "csv";
    check_trajectory_format(format_);
    if (recorded_.split && !recorded_.align && arguments_.part.empty()) {
      throw InputError(prefix_ + "--split without --align: there is nothing to align",
                       "add --align or --part, or leave --split out: figures are of the whole recording");
    }
    if (recorded_.split && !(*recorded_.split > 0 && *recorded_.split < 1)) {
      throw InputError(fmt::format("--split {} is out of range", *recorded_.split),
                       "it is the share of epochs that the city is aligned by, above 0 and below 1");
    }
    align_options_ = arguments_.alignment;
    align_options_.heading = recorded_.align_heading;
    align_options_.threads = arguments_.threads;
    align_options_.seed = scenario_.seed;

    const simulation::ReceiverConfig& receiver = scenario_.receivers.front();
    const simulation::Georeference& georeference = scenario_.city.georeference;
    const bool uncertain = georeference.sigma_m > 0 || georeference.heading_sigma_rad > 0;
    if (arguments_.runs && !uncertain) {
      throw InputError(
          prefix_ + "--runs without an uncertainty of the city's place: every run would be the same",
          "add city: {georeference: {sigma_m: 3}} to the scenario");
    }
    runs_ = arguments_.runs.value_or(10);
    const std::string drawn =
        uncertain ? fmt::format(", {} cities drawn within {:g} m", runs_, georeference.sigma_m) : "";
    models_.push_back(
        {"", fmt::format("{} (the scenario's{})", receiver.options.name, drawn), receiver, uncertain});
    std::vector<validation::Model> more;
    if (arguments_.ladder) {
      more = validation::model_ladder(receiver);
    } else if (!arguments_.models.empty()) {
      std::vector<std::string> keys;
      for (const std::string_view key : split(arguments_.models, ',')) keys.emplace_back(trim(key));
      more = validation::models_of(receiver, keys);
    }
    models_.insert(models_.end(), more.begin(), more.end());
  }

  void load() {
    // The sky is built for the recording's time: the scenario's own trajectory is not simulated.
    rinex::ObservationOptions wanted;
    wanted.systems = scenario_.sky.systems;
    wanted.all_signals = true;
    auto recorded = rinex::read_rinex_observations(*recorded_.obs, wanted);
    const geodesy::GpsTime first = recorded.epochs.front().receiver_time;
    const geodesy::GpsTime last = recorded.epochs.back().receiver_time;

    city::City city = simulation::load_city(scenario_.city, scenario_.seed);
    simulation::BuiltSky sky = simulation::build_sky(scenario_.sky, first, last, city.frame.origin());
    warn(sky.warnings);
    environment_ =
        std::make_unique<simulation::Environment>(std::move(city), sky.sky, sky.navigation.klobuchar);

    validation::RecordingOptions options;
    options.ionosphere = options.troposphere = !arguments_.no_atmosphere;
    options.nmea = recorded_.nmea;
    recording_ = validation::join_recording(scenario_, *environment_, *recorded_.obs, std::move(recorded),
                                            truth_, format_, options);
    warn(recording_.warnings);
    const validation::PseudorangeResiduals& residuals = recording_.residuals;
    note(fmt::format("recording   {} epochs, {} pseudoranges", residuals.epochs.size(),
                     residuals.observations.size() + residuals.further.size()));
    notes_.push_back(fmt::format("observations {}", recorded_.obs->string()));
    notes_.push_back(fmt::format("truth {}", truth_.string()));
    if (recorded_.nmea) notes_.push_back(fmt::format("own fixes {}", recorded_.nmea->string()));
    notes_.push_back("canyon " CANYON_VERSION);
  }

  /// The first part aligns the city; figures are of the part that is asked for.
  void choose_parts() {
    const std::size_t all = recording_.residuals.epochs.size();
    const std::string& part = arguments_.part;
    const double share = recorded_.split.value_or(0.5);
    const auto first = static_cast<std::size_t>(std::lround(share * static_cast<double>(all)));
    const bool whole = part == "all" || (part.empty() && !recorded_.align);
    if (!whole || recorded_.align) {
      if (first < kFewestEpochs || all - first < kFewestEpochs) {
        throw InputError(
            fmt::format("{}the recording's {} epochs make parts of {} and {}", prefix_, all, first,
                        all - first),
            fmt::format(
                "aligning and judging need {} epochs each: give a longer recording or another --split",
                kFewestEpochs));
      }
      aligned_by_ = share == 0.5 ? "first half" : "first " + share_name(share);
    }
    aligned_ = first;
    if (whole) {
      part_ = "whole recording";
      count_ = all;
    } else if (part == "first") {
      part_ = aligned_by_;
      count_ = first;
    } else {
      part_ = share == 0.5 ? "second half" : "last " + share_name(1 - share);
      first_ = first;
      count_ = all - first;
    }
  }

  void align() {
    Progress progress(prefix_ + "aligning the city", arguments_.quiet);
    align_options_.progress = progress_of(progress);
    alignment_ = validation::align(recording_, *environment_,
                                   scenario_.receivers.front().options.fix.elevation_mask_rad, 0, aligned_,
                                   align_options_);
    if (alignment_->at_border) {
      warn({fmt::format("the best place of the city lies at the end of the search: give more than --reach {}",
                        align_options_.reach_m)});
    }
    const double sigma_m = std::max(alignment_->sigma_east_m, alignment_->sigma_north_m);
    if (alignment_->score < kTellingScore || sigma_m > align_options_.reach_m / 4) {
      warn({fmt::format(
          "the recording does not tell where the city stands (mean AUC {:.2f}, +- {:.1f} m): check the "
          "scenario's origin and offset, or search farther with --reach {:g}",
          alignment_->score, sigma_m, std::min(200.0, 4 * align_options_.reach_m))});
    }
  }

  void compare() {
    const validation::Registration registration =
        alignment_ ? alignment_->registration : validation::Registration{};
    std::vector<validation::NeverTracked> never;
    validation::CompareOptions options;
    options.threads = arguments_.threads;
    for (const validation::Model& model : models_) {
      Progress progress(fmt::format("{}simulating: {}", prefix_, model.name), arguments_.quiet);
      options.name = model.name;
      const int moved = model.moved_city ? runs_ : 0;
      int done_runs = 0;
      const auto told = progress_of(progress);
      options.progress = [&](std::size_t done, std::size_t total) {
        told(static_cast<std::size_t>(done_runs) * total + done, static_cast<std::size_t>(moved + 1) * total);
      };
      const auto simulate = [&](const validation::Registration& place, std::uint64_t seed) {
        return validation::compare(recording_, model.receiver, *environment_, place, seed, options);
      };
      validation::Comparison comparison = simulate(registration, scenario_.seed);
      const bool own = figures_.empty();
      if (own) {
        never = validation::never_tracked(comparison);
        if (!arguments_.all_satellites && !never.empty()) {
          for (const validation::NeverTracked& s : never) options.leave_out.insert(s.id);
          comparison = simulate(registration, scenario_.seed);
        }
      }
      std::vector<validation::Comparison> runs;
      for (int run = 0; run < moved; ++run) {
        ++done_runs;
        const std::uint64_t seed = scenario_.seed + static_cast<std::uint64_t>(run);
        runs.push_back(simulate(moved_by_chance(registration, seed), seed));
      }
      validation::Figures& f = figures_.emplace_back(
          validation::figures(comparison, first_, count_,
                              validation::describe_part(comparison, first_, count_, part_), {}, runs));
      f.never_tracked = never;
      f.left_out = !arguments_.all_satellites;
      if (!own) continue;
      if (alignment_) aligned_by_ = validation::describe_part(comparison, 0, aligned_, aligned_by_);
      if (recorded_.nmea) {
        options.position_filter = true;
        f.own_fixes =
            validation::own_fix_figures(validation::own_fixes_of(recording_, comparison, first_, count_),
                                        simulate(registration, scenario_.seed), first_, count_);
        options.position_filter = false;
      }
      own_ = std::move(comparison);
      runs_of_own_ = std::move(runs);
    }
  }

  /// Where one run's city stands, as the scenario's georeference draws it.
  [[nodiscard]] validation::Registration moved_by_chance(const validation::Registration& registration,
                                                         std::uint64_t seed) const {
    const auto shift = simulation::draw_city_shift(scenario_.city.georeference, seed);
    if (!shift) return registration;
    const city::Box bounds = environment_->city().bounds();
    return registration.then(shift->east_m, shift->north_m, shift->heading_rad,
                             0.5 * (bounds.min + bounds.max).head<2>());
  }

  [[nodiscard]] std::string alignment_text() const {
    const validation::Registration& r = alignment_->registration;
    std::string text = fmt::format("city moved by east {:.2f} +- {:.2f} m, north {:.2f} +- {:.2f} m",
                                   r.east_m, alignment_->sigma_east_m, r.north_m, alignment_->sigma_north_m);
    if (align_options_.heading) {
      text += fmt::format(", turned by {:.2f} +- {:.2f} deg about east {:.0f}, north {:.0f} m",
                          geodesy::degrees(r.heading_rad), geodesy::degrees(alignment_->sigma_heading_rad),
                          r.pivot.x(), r.pivot.y());
    }
    return text + fmt::format("\n  estimated on the {}; mean AUC there {:.3f}, unmoved {:.3f}\n", aligned_by_,
                              alignment_->score, alignment_->score_before);
  }

  const Arguments& arguments_;
  validation::ListedRecording recorded_;
  std::string prefix_;  ///< of messages, among several recordings
  const std::atomic<bool>& stop_;
  simulation::Scenario scenario_;
  std::filesystem::path truth_;
  std::string format_, aligned_by_, part_;
  validation::AlignOptions align_options_;
  std::vector<validation::Model> models_;
  int runs_ = 1;  ///< of models with a moved city
  std::unique_ptr<simulation::Environment> environment_;
  validation::Recording recording_;
  std::size_t aligned_ = 0;            ///< epochs of the first part
  std::size_t first_ = 0, count_ = 0;  ///< epochs that figures are of
  std::optional<validation::Alignment> alignment_;
  std::vector<validation::Figures> figures_;
  validation::Comparison own_;
  std::vector<validation::Comparison> runs_of_own_;
  std::vector<std::string> notes_;
};

/// The recordings of a list, or the one that the command line names.
std::vector<validation::ListedRecording> recordings_of(const Arguments& arguments, bool listed) {
  if (listed) {
    for (const auto& [name, value] : {std::pair("--obs", &arguments.obs),
                                      {"--truth", &arguments.truth},
                                      {"--format", &arguments.format},
                                      {"--nmea", &arguments.nmea}}) {
      if (value->empty()) continue;
      throw InputError(fmt::format("{} beside a list of recordings", name),
                       "the list names the files of each recording");
    }
    return validation::read_recording_list(arguments.scenario).recordings;
  }
  if (arguments.obs.empty()) {
    throw InputError("--obs is missing", "give the recorded observations, or a list of recordings");
  }
  validation::ListedRecording one;
  one.scenario = arguments.scenario;
  one.obs = arguments.obs;
  if (!arguments.truth.empty()) one.truth = arguments.truth;
  if (!arguments.nmea.empty()) one.nmea = arguments.nmea;
  one.truth_format = arguments.format;
  if (!arguments.old_format.empty()) {
    one.truth_format = arguments.old_format;
    if (!arguments.quiet) print_warnings({"--truth-format is now --format; the old name will go"});
  }
  return {one};
}

/// Classes of several recordings, observations of all of them together.
std::vector<validation::RecordingRow> pooled_rows(const std::vector<std::unique_ptr<Judge>>& judges) {
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
    validation::FigureOptions options;
    options.resamples = 0;
    row.headlines =
        validation::headlines(validation::figures(all.comparison, 0, count, "", options, all.runs));
    options.resamples = kResamples;
    validation::add_intervals(row.headlines, all.comparison, 0, count, options, all.runs);
    rows.push_back(std::move(row));
  }
  return rows;
}

/// Everything at the end: an interrupted run leaves nothing.
void write(const Arguments& arguments, const std::vector<std::unique_ptr<Judge>>& judges, bool listed) {
  const Judge& one = *judges.front();
  std::vector<validation::RecordingRow> rows;
  if (listed) {
    for (const auto& judge : judges) rows.push_back(judge->row());
    for (validation::RecordingRow& row : pooled_rows(judges)) rows.push_back(std::move(row));
  }
  std::string markdown = listed ? validation::to_markdown(rows) : one.markdown();
  for (const auto& judge : judges) {
    if (listed && judge->several_models()) {
      markdown += fmt::format("\nModels, {}:\n\n{}", judge->recorded().name, judge->markdown());
    }
  }
  if (!arguments.report.empty()) {
    const std::filesystem::path folder = arguments.report;
    if (listed) {
      for (const auto& judge : judges) judge->write_report(folder / judge->recorded().name);
      validation::write_overview(folder, std::filesystem::path(arguments.scenario).stem().string(), rows,
                                 {"canyon " CANYON_VERSION});
    } else {
      one.write_report(folder);
    }
    note(arguments, fmt::format("report in {}", arguments.report));
  }
  if (!arguments.markdown.empty()) write_file(arguments.markdown, markdown);
  const auto json = [&] { return listed ? validation::to_json(rows) : one.json(); };
  if (arguments.json == "-") {
    fmt::print("{}", json());
    return;
  }
  if (!arguments.json.empty()) write_file(arguments.json, json());
  if (arguments.quiet) return;
  if (!listed) {
    fmt::print("{}", one.text());
    return;
  }
  for (const auto& judge : judges) fmt::print("{}", judge->alignment_line());
  fmt::print("\n{}", markdown);
}

int run(const Arguments& arguments) {
  try {
    const bool listed = validation::is_recording_list(arguments.scenario);
    std::vector<std::unique_ptr<Judge>> judges;
    for (const validation::ListedRecording& recording : recordings_of(arguments, listed)) {
      judges.push_back(std::make_unique<Judge>(arguments, recording, listed));
    }
    if (!arguments.report.empty()) {
      make_output_folder(arguments.report);
      for (const auto& judge : judges) {
        if (listed) make_output_folder(std::filesystem::path(arguments.report) / judge->recorded().name);
      }
    }
    for (const auto& judge : judges) judge->run();
    write(arguments, judges, listed);
    return kOk;
  } catch (const Interrupted&) {
    fmt::print(stderr, "canyon: interrupted: nothing was written\n");
    return kInterrupted;
  }
}

}  // namespace

void add_validate(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("validate", "judge a scenario beside what a real receiver recorded");
  command
      ->add_option("scenario", arguments->scenario,
                   "scenario file: city, sky and first receiver; or a list of recordings, each with its own")
      ->type_name("SCENARIO|LIST")
      ->required();
  command->add_option("--obs", arguments->obs, "recorded observations, RINEX 2, 3 or 4 (not with a list)")
      ->type_name("FILE");
  command->add_option("--truth", arguments->truth, "true positions (the scenario's trajectory file)")
      ->type_name("FILE");
  CLI::Option* format =
      command->add_option("--format", arguments->format,
                          "of the true positions: csv, urbannav or nmea (that of the scenario's trajectory, "
                          "else csv)");
  format->type_name("FORMAT");
  command->add_option("--truth-format", arguments->old_format)->excludes(format)->group("");
  command
      ->add_option("--nmea", arguments->nmea,
                   "the recorded receiver's own fixes (GGA), judged beside the position filter's")
      ->type_name("FILE");
  CLI::Option* align = command->add_flag(
      "--align", arguments->align,
      "estimate the city's offset on the first part of the recording; figures are then of the rest");
  command->add_flag("--align-heading", arguments->alignment.heading, "its heading as well")->needs(align);
  add_field(*command, "--reach", arguments->alignment, "reach_m")->needs(align);
  command->add_option("--split", arguments->split, "share of epochs of the first part (0.5)")
      ->type_name("SHARE");
  command
      ->add_option("--part", arguments->part,
                   "that figures are of: first (which the city is aligned by), rest or all (the rest with "
                   "--align, else all)")
      ->type_name("PART")
      ->check(CLI::IsMember({"first", "rest", "all"}));
  command->add_flag("--all-satellites", arguments->all_satellites,
                    "keep satellites that the recording never tracks although they stand above 30 deg in "
                    "clear view for a minute and more");
  CLI::Option* models = command->add_option("--models", arguments->models,
                                            "beside the scenario's own: mirror, specular, second, tracking, "
                                            "diffuse, ground, shadowing, diffraction");
  models->type_name("LIST");
  command->add_flag("--ladder", arguments->ladder, "all of these, each an addition to the one before")
      ->excludes(models);
  command
      ->add_option("--report", arguments->report,
                   "folder for report.html and its pictures, made where needed")
      ->type_name("DIR");
  command->add_option("--json", arguments->json, "write the figures as JSON; -: to standard output, alone")
      ->type_name("FILE");
  command
      ->add_option("--markdown", arguments->markdown,
                   "write the table of all models, or of all recordings of a list, as Markdown")
      ->type_name("FILE");
  command->add_flag("--no-atmosphere", arguments->no_atmosphere,
                    "recordings are simulated ones without ionosphere and troposphere");
  command->add_option("--seed", arguments->seed, "instead of the scenario's seed")->type_name("N");
  command
      ->add_option(
          "--runs", arguments->runs,
          "cities drawn by the scenario's city.georeference, whose simulated values are taken together (10)")
      ->type_name("N")
      ->check(CLI::Range(1, 1000));
  add_threads(*command, arguments->threads);
  command->add_flag("--quiet", arguments->quiet, "print errors only (and what --json - asks for)");
  command->footer(
      "Each recorded pseudorange gets its error from the true positions; the city's rays say which "
      "satellites\n"
      "were in line of sight. Signals beyond each satellite's first are judged where the receiver tracks\n"
      "them, carrier phases of all. docs/recordings.md explains the figures, and lists: a YAML file\n"
      "  recordings: [{name: a, scenario: a.yaml, obs: a.obs, class: mass market, align: true}, ...]\n"
      "whose recordings are judged beside each other, and those of a class together.");
  command->callback([arguments, &action] { action = [arguments] { return run(*arguments); }; });
}

}  // namespace canyon::cli
