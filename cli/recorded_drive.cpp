#include "cli/recorded_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "canyon/analysis/validation/metrics_text.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/georeference.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "cli/commands.hpp"
#include "cli/field_option.hpp"

namespace canyon::cli {
namespace {

/// Minimum number of epochs for aligning and for validating.
constexpr std::size_t kMinEpochs = 10;
/// Below this mean AUC the city and the recording hardly match: 0.5 is chance, 0.88 is the value of a city of
/// OpenStreetMap outlines (docs/results.md).
constexpr double kTellingScore = 0.7;

std::string fraction_name(double split) {
  if (split == 0.5) return "half";
  return fmt::format("{:.0f} %", 100 * split);
}

/// The recording, with the command line's options if the list does not set them.
validation::ListedRecording with_options(validation::ListedRecording recording,
                                         const DriveArguments& arguments) {
  recording.align = recording.align || arguments.align;
  recording.align_heading = recording.align_heading || arguments.alignment.heading;
  if (arguments.split) recording.split = arguments.split;
  return recording;
}

}  // namespace

void add_drive_options(Command& command, DriveArguments& arguments) {
  command
      .add_option("scenario", arguments.scenario, "SCENARIO|LIST",
                  "scenario file: city, sky and first receiver; or a list of recordings, each with its own")
      .required();
  command.add_option(
      "--obs", arguments.obs, "FILE",
      "recorded observations: RINEX 2, 3 or 4, or a log of Android's GnssLogger (not with a list)");
  command.add_option("--truth", arguments.truth, "FILE|POSITION",
                     "true positions, or LAT,LON,HEIGHT of a fixed antenna (the scenario's trajectory)");
  command
      .add_option("--format", arguments.format, "FORMAT",
                  fmt::format("format of the true positions: {} (detected from the file's content)",
                              fmt::join(simulation::trajectory_formats(), ", ")))
      .formerly("--truth-format");
  command.add_option("--nmea", arguments.nmea, "FILE",
                     "fixes that the receiver reported (GGA), to compare with the position filter's");
  command.add_flag(
      "--align", arguments.align,
      "estimate the city's offset on the first part of the recording; metrics are then of the rest");
  command.add_flag("--align-heading", arguments.alignment.heading, "also estimate its heading")
      .needs("--align");
  add_field(command, "--search-radius", arguments.alignment, "reach_m").formerly("--reach").needs("--align");
  command.add_option("--split", arguments.split, "FRACTION", "fraction of epochs in the first part (0.5)");
  command.add_flag("--no-atmosphere", arguments.no_atmosphere,
                   "recordings are simulated ones without ionosphere and troposphere");
  command.add_option("--seed", arguments.seed, "N", "instead of the scenario's seed");
  add_threads(command, arguments.threads);
}

std::vector<validation::ListedRecording> recordings_of(const DriveArguments& arguments, bool listed) {
  if (listed) {
    for (const auto& [name, value] : {std::pair("--obs", &arguments.obs),
                                      {"--truth", &arguments.truth},
                                      {"--format", &arguments.format},
                                      {"--nmea", &arguments.nmea}}) {
      if (value->empty()) continue;
      throw InputError(fmt::format("{} has no effect with a list of recordings", name),
                       "give the files of each recording in the list");
    }
    return validation::read_recording_list(arguments.scenario).recordings;
  }
  if (arguments.obs.empty())
    throw InputError("--obs is missing", "give the recorded observations, or a list of recordings");
  validation::ListedRecording one;
  one.scenario = arguments.scenario;
  one.obs = arguments.obs;
  if (!arguments.truth.empty()) one.truth = arguments.truth;
  if (!arguments.nmea.empty()) one.nmea = arguments.nmea;
  one.truth_format = arguments.format;
  return {one};
}

bool write_results(const DriveArguments& arguments, const std::function<std::string()>& json) {
  const auto text = [&json] {
    Json all = Json::parse(json());
    if (all.is_object()) all["report"] = printed_reports();
    return all.dump(2) + "\n";
  };
  if (arguments.json == "-") {
    fmt::print("{}", text());
    return false;
  }
  if (!arguments.json.empty()) write_file(arguments.json, text());
  return !arguments.quiet;
}

RecordedDrive::RecordedDrive(const DriveArguments& arguments, const validation::ListedRecording& recording,
                             bool listed)
    : arguments_(arguments),
      recorded_(with_options(recording, arguments)),
      prefix_(listed ? recording.name + ": " : ""),
      stop_(catch_interrupts()),
      scenario_(read_scenario()) {
  check();
}

void RecordedDrive::load() {
  read();
  choose_parts();
  if (recorded_.align) align();
}

simulation::Scenario RecordedDrive::read_scenario() const {
  simulation::Scenario scenario = recorded_.profile.empty() ? simulation::read_scenario(*recorded_.scenario)
                                                            : simulation::read_scenario_with_profile(
                                                                  *recorded_.scenario, recorded_.profile);
  if (arguments_.seed) scenario.seed = *arguments_.seed;
  return scenario;
}

void RecordedDrive::note(const std::string& text) const {
  cli::note(arguments_.quiet, prefix_ + text);
}

void RecordedDrive::warn(const std::vector<std::string>& lines) const {
  for (const std::string& line : lines) print_warnings({prefix_ + line});
}

std::function<void(std::size_t, std::size_t)> RecordedDrive::progress_of(ProgressLine& progress) const {
  return [this, &progress](std::size_t done, std::size_t total) {
    if (stop_.load()) throw Interrupted{};
    progress.update(done, total);
  };
}

validation::Comparison RecordedDrive::simulate(const simulation::ReceiverConfig& receiver) {
  const auto simulated = [&] { return simulate(receiver, *environment_, registration(), scenario_.seed); };
  validation::Comparison comparison = simulated();
  if (never_tracked_) return comparison;
  never_tracked_ = validation::never_tracked(comparison);
  if (arguments_.all_satellites || never_tracked_->empty()) return comparison;
  for (const validation::NeverTracked& s : *never_tracked_) compare_.leave_out.insert(s.id);
  return simulated();
}

validation::Comparison RecordedDrive::simulate(const simulation::ReceiverConfig& receiver,
                                               const simulation::Environment& environment,
                                               const validation::Registration& position,
                                               std::uint64_t seed) const {
  return validation::compare(recording_, receiver, environment, position, seed, compare_);
}

std::unique_ptr<simulation::Environment> RecordedDrive::sampled_environment(simulation::Scenario scenario) {
  return redrawn_.draw(sky_, std::move(scenario));
}

validation::ModelMetrics RecordedDrive::metrics_of(const validation::Comparison& comparison, const Part& part,
                                                   const std::vector<validation::Comparison>& runs) const {
  validation::ModelMetrics metrics =
      validation::metrics(comparison, part.first, part.count,
                          validation::describe_part(comparison, part.first, part.count, part.name), {}, runs);
  metrics.never_tracked = never_tracked_.value_or(std::vector<validation::NeverTracked>());
  metrics.left_out = !arguments_.all_satellites;
  return metrics;
}

void RecordedDrive::add_reported_fixes(validation::ModelMetrics& metrics,
                                       const validation::Comparison& comparison) const {
  if (!recorded_.nmea) return;
  metrics.reported_fixes = validation::reported_fix_metrics(recording_, comparison, part_.first, part_.count);
}

validation::RecordingRow RecordedDrive::row_of(const std::string& name,
                                               const validation::ModelMetrics& metrics,
                                               const validation::Comparison& comparison,
                                               const std::vector<validation::Comparison>& runs) const {
  validation::RecordingRow row;
  row.name = name;
  row.receiver_class = recorded_.receiver_class;
  row.part = metrics.part;
  row.never_tracked = validation::never_tracked_text(metrics);
  row.key_metrics = validation::key_metrics(metrics);
  validation::MetricOptions options;
  options.resamples = kResamples;
  validation::add_intervals(row.key_metrics, comparison, part_.first, part_.count, options, runs);
  return row;
}

void RecordedDrive::check() {
  if (parse_numbers(arguments_.truth).size() == 3) {
    recorded_.truth.reset();
    scenario_.trajectory = {};
    scenario_.trajectory.waypoints = {parse_position(arguments_.truth, "--truth")};
  }
  validation::resolve_truth(scenario_, recorded_, prefix_ + "--truth");
  check_trajectory_format(recorded_.truth_format);
  if (recorded_.split && !recorded_.align && arguments_.part.empty()) {
    throw InputError(prefix_ + "--split without --align: there is nothing to align",
                     "add --align or --part, or leave --split out to use the whole recording");
  }
  if (recorded_.split && !(*recorded_.split > 0 && *recorded_.split < 1)) {
    throw InputError(fmt::format("--split {} is out of range", *recorded_.split),
                     "give the fraction of epochs for the alignment, above 0 and below 1");
  }
  align_options_ = arguments_.alignment;
  align_options_.heading = recorded_.align_heading;
  align_options_.threads = arguments_.threads;
  align_options_.seed = scenario_.seed;
  compare_.threads = arguments_.threads;
}

void RecordedDrive::read() {
  validation::RecordedScene scene =
      validation::read_recorded_scene(scenario_, recorded_, !arguments_.no_atmosphere);
  sky_ = std::move(scene.sky);
  environment_ = std::move(scene.environment);
  recording_ = std::move(scene.recording);
  ReadReport report = environment_->city().notes;
  report.add_line(ReadReport::Level::Guess, scenario_.warnings);
  report.append(sky_.report);
  report.add_line(ReadReport::Level::Guess, recording_.warnings);
  print_report(report, "the report of --json", prefix_);
  const validation::PseudorangeResiduals& residuals = recording_.residuals;
  note(fmt::format("recording   {} epochs, {} pseudoranges", residuals.epochs.size(),
                   residuals.observations.size() + residuals.further.size()));
}

validation::Registration RecordedDrive::registration(const simulation::Georeference& georeference,
                                                     std::uint64_t seed) const {
  const auto shift = simulation::draw_city_shift(georeference, seed);
  if (!shift) return registration();
  const city::Box bounds = environment_->city().bounds();
  return registration().then(shift->east_m, shift->north_m, shift->heading_rad,
                             0.5 * (bounds.min + bounds.max).head<2>());
}

/// The first part aligns the city; metrics are of the requested part.
void RecordedDrive::choose_parts() {
  const std::size_t all = recording_.residuals.epochs.size();
  const std::string& part = arguments_.part;
  const double fraction = recorded_.split.value_or(0.5);
  const auto first = static_cast<std::size_t>(std::lround(fraction * static_cast<double>(all)));
  const bool whole = part == "all" || (part.empty() && !recorded_.align);
  if (!whole || recorded_.align) {
    if (first < kMinEpochs || all - first < kMinEpochs) {
      throw InputError(
          fmt::format("{}the recording's {} epochs give parts of {} and {}", prefix_, all, first,
                      all - first),
          fmt::format(
              "aligning and validating need {} epochs each: give a longer recording or another --split",
              kMinEpochs));
    }
    first_part_.name = aligned_by_ = fraction == 0.5 ? "first half" : "first " + fraction_name(fraction);
  }
  first_part_.count = first;
  if (whole) {
    part_.name = "whole recording";
    part_.count = all;
  } else if (part == "first") {
    part_.name = first_part_.name;
    part_.count = first;
  } else {
    part_.name = fraction == 0.5 ? "second half" : "last " + fraction_name(1 - fraction);
    part_.first = first;
    part_.count = all - first;
  }
}

void RecordedDrive::align() {
  ProgressLine progress(prefix_ + "aligning the city", arguments_.quiet);
  align_options_.progress = progress_of(progress);
  alignment_ =
      validation::align(recording_, *environment_, scenario_.receivers.front().options.fix.elevation_mask_rad,
                        0, first_part_.count, align_options_);
  if (alignment_->at_border) {
    warn({fmt::format("the best city offset is at the edge of the search; increase --search-radius (now {})",
                      align_options_.reach_m)});
  }
  const double sigma_m = std::max(alignment_->sigma_east_m, alignment_->sigma_north_m);
  if (alignment_->score < kTellingScore || sigma_m > align_options_.reach_m / 4) {
    warn(
        {fmt::format("the recording does not determine the city's offset (mean AUC {:.2f}, +- {:.1f} m): "
                     "check the scenario's origin and offset, or search farther with --search-radius {:g}",
                     alignment_->score, sigma_m, std::min(200.0, 4 * align_options_.reach_m))});
  }
}

std::string RecordedDrive::alignment_text() const {
  const validation::Registration& r = alignment_->registration;
  std::string text = fmt::format("city moved by east {:.2f} +- {:.2f} m, north {:.2f} +- {:.2f} m", r.east_m,
                                 alignment_->sigma_east_m, r.north_m, alignment_->sigma_north_m);
  if (align_options_.heading) {
    text += fmt::format(", rotated by {:.2f} +- {:.2f} deg about east {:.0f}, north {:.0f} m",
                        geodesy::degrees(r.heading_rad), geodesy::degrees(alignment_->sigma_heading_rad),
                        r.pivot.x(), r.pivot.y());
  }
  return text + fmt::format("\n  estimated on the {}; mean AUC there {:.3f}, unmoved {:.3f}\n", aligned_by_,
                            alignment_->score, alignment_->score_before);
}

}  // namespace canyon::cli
