#include <fmt/format.h>

#include <cstdio>

#include "canyon/analysis/calibration/calibrate.hpp"
#include "canyon/analysis/validation/metrics.hpp"
#include "canyon/analysis/validation/metrics_text.hpp"
#include "canyon/analysis/validation/recording_table.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/options/node.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "cli/commands.hpp"
#include "cli/progress.hpp"
#include "cli/recorded_drive.hpp"

namespace canyon::cli {
namespace {

struct CalibrateArguments : DriveArguments {
  std::string out, profile, calibrate_by = "first";
};

options::Node tree_of(const std::filesystem::path& scenario) {
  constexpr std::size_t kMaxBytes = std::size_t{16} << 20;
  const TextFile file(scenario, kMaxBytes);
  options::Document document;
  document.file = scenario;
  return options::parse_yaml(std::string(file.text()), document, "a scenario");
}

/// The first receiver in a scenario's file; empty without one.
options::Node first_receiver(const std::filesystem::path& scenario) {
  const options::Node root = tree_of(scenario);
  const options::Node::Entry* receivers = root.find("receivers");
  if (receivers == nullptr || receivers->value.items.empty()) return {};
  return receivers->value.items.front();
}

/// The name or absolute path of a recording's profile; empty: its scenario has none.
std::string profile_of(const validation::ListedRecording& recording) {
  if (!recording.profile.empty()) return recording.profile;
  const options::Node receiver = first_receiver(*recording.scenario);
  const options::Node::Entry* profile = receiver.find("profile");
  if (profile == nullptr) return {};
  if (!simulation::is_profile_path(profile->value.text)) return profile->value.text;
  return std::filesystem::absolute(recording.scenario->parent_path() / profile->value.text).string();
}

simulation::Profile base_profile(const std::string& name) {
  if (simulation::is_profile_path(name)) return simulation::read_profile(name);
  return simulation::parse_profile(std::string(simulation::built_in_profile(name).text), name);
}

/// The lines to add to the scenario for its city and its obstacles; empty if it need not change.
std::vector<std::string> scenario_lines(const calibration::Calibration& result) {
  std::vector<std::string> lines;
  if (const auto fraction = calibration::fitted_glass(result)) {
    lines.push_back(fmt::format("city: {{facades: {{fractions: [{}]}}}}",
                                fmt::join(calibration::facade_fractions(*fraction), ", ")));
  }
  if (const auto fraction = result.values.find(calibration::kSkylineFraction);
      fraction != result.values.end())
    lines.push_back(fmt::format("shadowing: {{skyline: {{share: {}}}}}", fraction->second));
  return lines;
}

/// One recording: its first part is used to calibrate, the rest to validate.
class CalibrationDrive : public RecordedDrive {
 public:
  using RecordedDrive::RecordedDrive;

  /// Must outlive the returned drive.
  [[nodiscard]] calibration::Drive drive(bool whole) {
    calibration::Drive d;
    d.name = recorded_.name;
    d.environment = environment_.get();
    const std::size_t count = whole ? recording_.residuals.epochs.size() : first_part_.count;
    d.recording = calibration::part_of(recording_, 0, count);
    d.registration = registration();
    d.receiver = scenario_.receivers.front();
    d.systems = scenario_.sky.systems;
    d.seed = scenario_.seed;
    d.facades = calibration::open_facades(
        scenario_, [this](const simulation::Scenario& sampled) { return sampled_environment(sampled); });
    return d;
  }
  /// Warns of keys of `values` that the scenario itself sets, which override the profile.
  void warn_of_overrides(const calibration::Values& values) {
    const options::Node receiver = first_receiver(*recorded_.scenario);
    for (const auto& [key, value] : values) {
      const options::Node::Entry* entry = receiver.find_path(key);
      if (entry == nullptr) continue;
      warn({fmt::format(
          "{}:{}: {} is below the receiver and overrides the calibrated profile: remove it there",
          recorded_.scenario->string(), entry->value.line, key)});
    }
  }
  /// Metrics of the part used to calibrate and of the held-out part, as in `canyon validate`.
  struct Rows {
    validation::RecordingRow fitted, held_out;
    validation::RecordingRow bound;  ///< the calibrated part itself, compared with the held-out part
  };
  [[nodiscard]] Rows validate(const std::string& called, const calibration::Calibration* calibrated,
                              bool quiet) {
    simulation::ReceiverConfig receiver = scenario_.receivers.front();
    if (calibrated != nullptr) {
      calibration::set_values(calibrated->values, receiver);
      if (const auto fraction = calibration::fitted_glass(*calibrated))
        environment_ = sampled_environment(calibration::with_coated_glass(scenario_, *fraction));
    }
    ProgressLine progress(fmt::format("{}comparing: {}", prefix_, called), quiet);
    compare_.progress = progress_of(progress);
    const validation::Comparison comparison = simulate(receiver);
    Rows rows;
    rows.fitted.name = prefix_ + "calibrated by";
    rows.fitted.key_metrics = validation::key_metrics(metrics_of(comparison, first_part_));
    rows.bound.name = fmt::format("{}recorded {}", prefix_, first_part_.name);
    rows.bound.key_metrics = validation::headlines_by_other_part(comparison, part_.first, part_.count,
                                                                 first_part_.first, first_part_.count);
    validation::ModelMetrics metrics = metrics_of(comparison, part_);
    add_reported_fixes(metrics, comparison);
    rows.held_out = row_of(prefix_ + called, metrics, comparison, {});
    rows.held_out.metrics_json = validation::to_json({metrics}, std::nullopt);
    return rows;
  }
  [[nodiscard]] std::string calibrated_by(bool whole) const {
    const std::string part = whole ? "whole recording" : first_part_.name;
    return recorded_.name.empty() ? part : fmt::format("{} ({})", recorded_.name, part);
  }
  [[nodiscard]] const std::atomic<bool>& stop() const { return stop_; }
};

std::vector<validation::RecordingRow> alternately(const std::vector<validation::RecordingRow>& before,
                                                  const std::vector<validation::RecordingRow>& after) {
  std::vector<validation::RecordingRow> rows;
  for (std::size_t i = 0; i < after.size(); ++i) {
    rows.push_back(before[i]);
    rows.push_back(after[i]);
  }
  return rows;
}

/// The expected result for the held-out part, from the calibrated part.
std::string expectation_of(const std::vector<validation::RecordingRow>& fitted) {
  validation::Score score;
  for (const validation::RecordingRow& row : fitted) score += validation::score_of(row.key_metrics);
  return fmt::format(
      "{} of {} metrics are within their ranges on the calibrated part; the held-out part will not be better",
      score.within, score.of);
}

std::string report_of(const calibration::Calibration& result,
                      const std::vector<validation::RecordingRow>& fitted,
                      const std::vector<validation::RecordingRow>& before,
                      const std::vector<validation::RecordingRow>& after,
                      const std::vector<validation::RecordingRow>& bound) {
  std::string text = "Receiver:\n\n" + calibration::to_text(result.estimates);
  if (result.coated_glass) text += "\nCity:\n\n" + calibration::to_text({*result.coated_glass});
  for (const std::string& line : scenario_lines(result))
    text += fmt::format("\nThis belongs in the scenario, not in the profile: {}\n", line);
  if (!result.notes.empty()) text += "\n";
  for (const std::string& note : result.notes) text += fmt::format("- {}.\n", note);
  if (after.empty())
    return text + "\nNothing was held out: metrics of the calibrated part are no validation.\n";
  return fmt::format(
      "{}\nExpected: {}.\n\n{}\nBy the held-out part:\n\n{}\n{}\nThe recorded first part in place "
      "of a simulation of the rest, a bound of what calibration can reach:\n\n{}",
      text, expectation_of(fitted), validation::score_card(fitted),
      validation::to_text(alternately(before, after)), validation::score_card(after),
      validation::score_card(bound));
}

std::string json_of(const calibration::Calibration& result,
                    const std::vector<validation::RecordingRow>& rows) {
  Json json;
  json["estimates"] = Json::parse(calibration::to_json(result.estimates));
  if (result.coated_glass) json["city"] = Json::parse(calibration::to_json({*result.coated_glass}));
  json["notes"] = result.notes;
  json["values"] = Json::object();
  for (const auto& [key, value] : result.values) json["values"][key] = value;
  json["judged"] = rows.empty() ? Json(nullptr) : Json::parse(validation::to_json(rows));
  return json.dump(2) + "\n";
}

/// Gives all recordings one profile: the command line's, else the first recording's.
std::string unite_profiles(const CalibrateArguments& arguments,
                           std::vector<validation::ListedRecording>& recordings) {
  std::string base = arguments.profile;
  if (simulation::is_profile_path(base)) base = std::filesystem::absolute(base).string();
  bool differ = !base.empty();
  if (base.empty()) {
    base = profile_of(recordings.front());
    for (const validation::ListedRecording& r : recordings) {
      const std::string own = profile_of(r);
      if (own == base) continue;
      differ = true;
      if (base.empty() || own.empty()) {
        throw InputError(
            fmt::format("'{}' and '{}' have no profile in common", recordings.front().name, r.name),
            "give --profile, the profile to calibrate");
      }
      print_warnings({fmt::format("{} has the profile {}; using {}", r.name, own, base)});
    }
  }
  if (!base.empty()) (void)base_profile(base);
  for (validation::ListedRecording& r : recordings)
    if (differ) r.profile = base;
  return base;
}

/// The profile with the estimates. @param base from unite_profiles() @param by names of the calibrated parts
std::string profile_of(const calibration::Calibration& result, const std::string& base,
                       const simulation::ReceiverConfig& receiver, const std::vector<std::string>& by) {
  simulation::Profile profile{"calibrated", receiver};
  profile.receiver.options.name = simulation::ReceiverConfig().options.name;
  if (!base.empty()) profile = base_profile(base);
  calibration::set_values(result.values, profile.receiver);
  calibration::ProfileHead head;
  head.base = base.empty()                        ? "the scenario"
              : simulation::is_profile_path(base) ? std::filesystem::path(base).filename().string()
                                                  : base;
  head.description = fmt::format("{}, calibrated by {}", profile.description, fmt::join(by, ", "));
  head.notes = {fmt::format("Written by canyon calibrate {} from {}; docs/methods.md describes it.",
                            CANYON_VERSION, head.base)};
  for (const std::string& line : scenario_lines(result))
    head.notes.push_back(fmt::format("For the scenario's location, from the same recordings: {}", line));
  for (const std::string& note : result.notes) head.notes.push_back(note + ".");
  return calibration::profile_text(profile.receiver, result.estimates, head);
}

int calibrate(const CalibrateArguments& given) {
  CalibrateArguments arguments = given;
  const bool whole = arguments.calibrate_by == "all";
  arguments.part = whole ? "all" : "rest";
  const std::string ending = std::filesystem::path(arguments.out).extension().string();
  if (ending != ".yaml" && ending != ".yml") {
    throw InputError(fmt::format("--out {}: a profile's file ends in .yaml", arguments.out),
                     "give a name that ends in .yaml: others are names of 'canyon profiles'");
  }
  const bool listed = validation::is_recording_list(arguments.scenario);
  std::vector<validation::ListedRecording> recordings = recordings_of(arguments, listed);
  const std::string base = unite_profiles(arguments, recordings);
  const auto drives = drives_of<CalibrationDrive>(arguments, recordings, listed);
  OutputFile out(arguments.out);

  std::vector<calibration::Drive> parts;
  std::vector<std::string> by;
  for (const auto& drive : drives) {
    drive->load();
    parts.push_back(drive->drive(whole));
    by.push_back(drive->calibrated_by(whole));
  }
  calibration::CalibrateOptions options;
  options.threads = arguments.threads;
  std::string doing;
  std::optional<ProgressLine> progress;
  options.progress = [&](const std::string& what, std::size_t done, std::size_t total) {
    if (drives.front()->stop().load()) throw Interrupted{};
    if (what != doing || !progress) progress.emplace("calibrating: " + what, arguments.quiet);
    doing = what;
    progress->update(done, total);
  };
  const calibration::Calibration result = calibration::calibrate(parts, options);
  progress.reset();

  std::vector<validation::RecordingRow> fitted, before, after, bound;
  for (const auto& drive : drives) {
    drive->warn_of_overrides(result.values);
    if (whole) continue;
    before.push_back(drive->validate("before", nullptr, arguments.quiet).held_out);
    CalibrationDrive::Rows rows = drive->validate("calibrated", &result, arguments.quiet);
    fitted.push_back(std::move(rows.fitted));
    after.push_back(std::move(rows.held_out));
    bound.push_back(std::move(rows.bound));
  }
  if (!fitted.empty()) note(arguments.quiet, "expected    " + expectation_of(fitted));

  out.write(profile_of(result, base, parts.front().receiver, by));
  out.commit();
  const std::string report = report_of(result, fitted, before, after, bound);
  const auto json = [&] { return json_of(result, alternately(before, after)); };
  if (!write_results(arguments, json)) return kOk;
  for (const auto& drive : drives) fmt::print("{}", drive->alignment_line());
  fmt::print("\n{}", report);
  std::fflush(stdout);
  fmt::print(stderr, "profile     {}\n", arguments.out);
  return kOk;
}

int run_calibrate(const CalibrateArguments& arguments) {
  return unless_interrupted([&] { return calibrate(arguments); });
}

}  // namespace

void add_calibrate(Command& app) {
  Command& command = app.add_command("calibrate", "fit a receiver profile to recordings of a real receiver");
  CalibrateArguments& arguments = command.run_with(run_calibrate);
  add_drive_options(command, arguments);
  command.add_option("-o,--out", arguments.out, "FILE", "the profile to write, FILE.yaml")
      .required()
      .writes();
  command.add_option(
      "--profile", arguments.profile, "NAME|FILE",
      "profile to calibrate: one of 'canyon profiles', or a file (that of the first recording)");
  command
      .add_option("--part", arguments.calibrate_by, "PART",
                  "part used for the calibration: first, then the rest is compared; or all, without a "
                  "comparison (first)")
      .one_of({"first", "all"});
  command
      .add_option("--json", arguments.json, "FILE",
                  "write estimates and metrics as JSON; -: to standard output, alone")
      .writes();
  command.add_flag("--quiet", arguments.quiet, "print warnings and errors only (and the output of --json -)");
  command.footer =
      "Estimates from the recording: tracked signals and orbits, step of C/N0, thresholds of lock. By\n"
      "simulation, from tracked satellites, their C/N0 and errors of hidden ones: level, fraction of "
      "obstacles,\n"
      "and facades of the area, which the report gives as a line for the scenario. A key keeps\n"
      "the profile's value if the recording has no information on it; comments in the file give the source\n"
      "of each number.\n"
      "Use it as 'profile: ./FILE.yaml'.\n"
      "docs/methods.md explains the method.";
}

}  // namespace canyon::cli
