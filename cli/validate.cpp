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
#include "canyon/simulation/simulator.hpp"
#include "canyon/validation/alignment.hpp"
#include "canyon/validation/comparison.hpp"
#include "canyon/validation/figures.hpp"
#include "canyon/validation/models.hpp"
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

struct Arguments {
  std::string scenario, obs, truth, format, old_format, report, models, json, markdown;
  bool align = false, ladder = false, no_atmosphere = false, quiet = false;
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

class Command {
 public:
  explicit Command(const Arguments& arguments)
      : arguments_(arguments), stop_(catch_interrupts()), scenario_(read_scenario()) {}

  int run() {
    check();
    load();
    choose_parts();
    if (arguments_.align) align();
    compare();
    write();
    return kOk;
  }

 private:
  [[nodiscard]] simulation::Scenario read_scenario() const {
    simulation::Scenario scenario = simulation::read_scenario(arguments_.scenario);
    if (arguments_.seed) scenario.seed = *arguments_.seed;
    return scenario;
  }

  void note(const std::string& text) const {
    if (arguments_.quiet) return;
    std::fflush(stdout);
    fmt::print(stderr, "{}\n", text);
  }
  void warn(const std::vector<std::string>& lines) {
    if (!arguments_.quiet) print_warnings(lines);
    for (const std::string& line : lines) notes_.push_back("warning: " + line);
  }
  [[nodiscard]] std::function<void(std::size_t, std::size_t)> progress_of(Progress& progress) const {
    return [this, &progress](std::size_t done, std::size_t total) {
      if (stop_.load()) throw Interrupted{};
      progress.update(done, total);
    };
  }

  /// Checks that need no city, before it is loaded.
  void check() {
    warn(scenario_.warnings);
    truth_ = arguments_.truth;
    format_ = arguments_.format;
    if (!arguments_.old_format.empty()) {
      format_ = arguments_.old_format;
      if (!arguments_.quiet) print_warnings({"--truth-format is now --format; the old name will go"});
    }
    if (truth_.empty()) {
      if (!scenario_.trajectory.file) {
        throw InputError("--truth is missing, and the scenario's trajectory is no file",
                         "give the file of true positions");
      }
      truth_ = *scenario_.trajectory.file;
    }
    if (format_.empty()) format_ = scenario_.trajectory.file ? scenario_.trajectory.format : "csv";
    check_trajectory_format(format_);
    if (arguments_.split && !arguments_.align) {
      throw InputError("--split without --align: there is nothing to align",
                       "add --align, or leave --split out: figures are of the whole recording");
    }
    if (arguments_.split && !(*arguments_.split > 0 && *arguments_.split < 1)) {
      throw InputError(fmt::format("--split {} is out of range", *arguments_.split),
                       "it is the share of epochs that the city is aligned by, above 0 and below 1");
    }
    align_options_ = arguments_.alignment;
    align_options_.threads = arguments_.threads;
    align_options_.seed = scenario_.seed;

    const simulation::ReceiverConfig& receiver = scenario_.receivers.front();
    const simulation::Georeference& georeference = scenario_.city.georeference;
    const bool uncertain = georeference.sigma_m > 0 || georeference.heading_sigma_rad > 0;
    if (arguments_.runs && !uncertain) {
      throw InputError("--runs without an uncertainty of the city's place: every run would be the same",
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
    if (!arguments_.report.empty()) make_output_folder(arguments_.report);
  }

  void load() {
    // The sky is built for the recording's time: the scenario's own trajectory is not simulated.
    rinex::ObservationOptions wanted;
    wanted.systems = scenario_.sky.systems;
    wanted.all_signals = true;
    auto recorded = rinex::read_rinex_observations(arguments_.obs, wanted);
    const geodesy::GpsTime first = recorded.epochs.front().receiver_time;
    const geodesy::GpsTime last = recorded.epochs.back().receiver_time;

    city::City city = simulation::load_city(scenario_.city);
    simulation::BuiltSky sky = simulation::build_sky(scenario_.sky, first, last, city.frame.origin());
    warn(sky.warnings);
    environment_ =
        std::make_unique<simulation::Environment>(std::move(city), sky.sky, sky.navigation.klobuchar);

    validation::RecordingOptions options;
    options.ionosphere = options.troposphere = !arguments_.no_atmosphere;
    recording_ = validation::join_recording(scenario_, *environment_, arguments_.obs, std::move(recorded),
                                            truth_, format_, options);
    warn(recording_.warnings);
    const validation::PseudorangeResiduals& residuals = recording_.residuals;
    note(fmt::format("recording   {} epochs, {} pseudoranges", residuals.epochs.size(),
                     residuals.observations.size() + residuals.further.size()));
    notes_.push_back(fmt::format("observations {}", arguments_.obs));
    notes_.push_back(fmt::format("truth {}", truth_.string()));
    notes_.push_back("canyon " CANYON_VERSION);
  }

  void choose_parts() {
    const std::size_t all = recording_.residuals.epochs.size();
    count_ = all;
    if (!arguments_.align) return;
    const double share = arguments_.split.value_or(0.5);
    first_ = static_cast<std::size_t>(std::lround(share * static_cast<double>(all)));
    count_ = all - first_;
    if (first_ < kFewestEpochs || count_ < kFewestEpochs) {
      throw InputError(
          fmt::format("the recording's {} epochs make parts of {} and {}", all, first_, count_),
          fmt::format("aligning and judging need {} epochs each: give a longer recording or another --split",
                      kFewestEpochs));
    }
  }

  void align() {
    Progress progress("aligning the city", arguments_.quiet);
    align_options_.progress = progress_of(progress);
    alignment_ = validation::align(recording_, *environment_,
                                   scenario_.receivers.front().options.fix.elevation_mask_rad, 0, first_,
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
    const double share = arguments_.split.value_or(0.5);
    const validation::Registration registration =
        alignment_ ? alignment_->registration : validation::Registration{};
    for (const validation::Model& model : models_) {
      Progress progress(fmt::format("simulating: {}", model.name), arguments_.quiet);
      validation::CompareOptions options;
      options.name = model.name;
      options.threads = arguments_.threads;
      const int moved = model.moved_city ? runs_ : 0;
      int done_runs = 0;
      const auto told = progress_of(progress);
      options.progress = [&](std::size_t done, std::size_t total) {
        told(static_cast<std::size_t>(done_runs) * total + done, static_cast<std::size_t>(moved + 1) * total);
      };
      validation::Comparison comparison = validation::compare(recording_, model.receiver, *environment_,
                                                              registration, scenario_.seed, options);
      std::vector<validation::Comparison> runs;
      for (int run = 0; run < moved; ++run) {
        ++done_runs;
        const std::uint64_t seed = scenario_.seed + static_cast<std::uint64_t>(run);
        runs.push_back(validation::compare(recording_, model.receiver, *environment_,
                                           moved_by_chance(registration, seed), seed, options));
      }
      const std::string part =
          alignment_ ? (share == 0.5 ? "second half" : "last " + share_name(1 - share)) : "whole recording";
      figures_.push_back(validation::figures(
          comparison, first_, count_, validation::describe_part(comparison, first_, count_, part), {}, runs));
      if (figures_.size() == 1) {
        if (alignment_) {
          aligned_by_ = validation::describe_part(comparison, 0, first_,
                                                  share == 0.5 ? "first half" : "first " + share_name(share));
        }
        own_ = std::move(comparison);
      }
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

  /// Everything at the end: an interrupted run leaves nothing.
  void write() {
    const std::optional<std::string> alignment_json =
        alignment_ ? std::optional(validation::to_json(*alignment_)) : std::nullopt;
    const std::string json = validation::to_json(figures_, alignment_json);
    const std::string markdown = validation::to_markdown(figures_);
    if (!arguments_.report.empty()) {
      validation::ReportInput report;
      report.title = scenario_.file.stem().string();
      report.city = &environment_->city();
      report.environment = environment_.get();
      report.comparison = &own_;
      report.first = first_;
      report.count = count_;
      report.models = figures_;
      report.alignment = alignment_;
      report.notes = notes_;
      validation::write_report(arguments_.report, report);
      note(fmt::format("report in {}", arguments_.report));
    }
    if (!arguments_.markdown.empty()) write_file(arguments_.markdown, markdown);
    if (arguments_.json == "-") {
      fmt::print("{}", json);
      return;
    }
    if (!arguments_.json.empty()) write_file(arguments_.json, json);
    if (arguments_.quiet) return;
    if (alignment_) fmt::print("{}\n", alignment_text());
    fmt::print("{}", validation::to_text(figures_.front()));
    if (figures_.size() > 1) fmt::print("\n{}", markdown);
  }

  const Arguments& arguments_;
  const std::atomic<bool>& stop_;
  simulation::Scenario scenario_;
  std::filesystem::path truth_;
  std::string format_, aligned_by_;
  validation::AlignOptions align_options_;
  std::vector<validation::Model> models_;
  int runs_ = 1;  ///< of models with a moved city
  std::unique_ptr<simulation::Environment> environment_;
  validation::Recording recording_;
  std::size_t first_ = 0, count_ = 0;  ///< epochs that figures are of
  std::optional<validation::Alignment> alignment_;
  std::vector<validation::Figures> figures_;
  validation::Comparison own_;
  std::vector<std::string> notes_;
};

int run(const Arguments& arguments) {
  try {
    return Command(arguments).run();
  } catch (const Interrupted&) {
    fmt::print(stderr, "canyon: interrupted: nothing was written\n");
    return kInterrupted;
  }
}

}  // namespace

void add_validate(CLI::App& app, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("validate", "judge a scenario beside what a real receiver recorded");
  command->add_option("scenario", arguments->scenario, "scenario file: city, sky and first receiver")
      ->type_name("SCENARIO")
      ->required();
  command->add_option("--obs", arguments->obs, "recorded observations, RINEX 2, 3 or 4")
      ->type_name("FILE")
      ->required();
  command->add_option("--truth", arguments->truth, "true positions (the scenario's trajectory file)")
      ->type_name("FILE");
  CLI::Option* format =
      command->add_option("--format", arguments->format,
                          "of the true positions: csv, urbannav or nmea (that of the scenario's trajectory, "
                          "else csv)");
  format->type_name("FORMAT");
  command->add_option("--truth-format", arguments->old_format)->excludes(format)->group("");
  CLI::Option* align = command->add_flag(
      "--align", arguments->align,
      "estimate the city's offset on the first part of the recording; figures are then of the rest");
  command->add_flag("--align-heading", arguments->alignment.heading, "its heading as well")->needs(align);
  add_field(*command, "--reach", arguments->alignment, "reach_m")->needs(align);
  command->add_option("--split", arguments->split, "share of epochs to align by (0.5)")->type_name("SHARE");
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
  command->add_option("--markdown", arguments->markdown, "write the table of all models as Markdown")
      ->type_name("FILE");
  command->add_flag("--no-atmosphere", arguments->no_atmosphere,
                    "the recording is a simulated one without ionosphere and troposphere");
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
      "them, carrier phases of all. docs/recordings.md explains the figures.");
  command->callback([arguments, &action] { action = [arguments] { return run(*arguments); }; });
}

}  // namespace canyon::cli
