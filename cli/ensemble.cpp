#include "cli/ensemble.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "canyon/base/output_file.hpp"
#include "canyon/base/predictive.hpp"
#include "canyon/calibration/calibrate.hpp"
#include "canyon/unknowns/unknowns.hpp"
#include "canyon/validation/ensemble.hpp"
#include "cli/commands.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {
namespace {

using Known = std::vector<unknowns::Unknown>;
using Told = std::function<void(std::size_t, std::size_t)>;

bool is_known(const Known& known, unknowns::Unknown unknown) {
  return std::find(known.begin(), known.end(), unknown) != known.end();
}

/// One recording, simulated by the settings as they are and by draws. Only the part that figures are of is
/// simulated.
class EnsembleDrive : public RecordedDrive {
 public:
  EnsembleDrive(const EnsembleArguments& arguments, const validation::ListedRecording& recording, bool listed)
      : RecordedDrive(arguments, recording, listed), arguments_(arguments) {
    if (arguments.unsaid) unknowns::forget(scenario_);
  }

  void start(const Known& known) {
    load();
    recording_ = calibration::part_of(recording_, part_.first, part_.count);
    place_map(known);
    row_.name = prefix_.empty() ? scenario_.file.stem().string() : recorded_.name;
    row_.unknowns = unknowns::priors_of(scenario_, known);
    simulate_point();
  }

  /// @param told of the epochs
  void draw(const unknowns::Draws& draws, std::size_t k, const Told& told) {
    simulation::Scenario scenario = scenario_;
    scenario.seed += k + 1;
    validation::EnsembleRow::Draw draw;
    draw.values = draws.apply(k, scenario);
    const validation::Registration place = registration(scenario.city.georeference, scenario.seed);
    const auto environment = drawn_environment(scenario);
    compare_.progress = told;
    const validation::Comparison run =
        simulate(scenario.receivers.front(), *environment, place, scenario.seed);
    draw.headlines = headlines({&run, 1});
    row_.draws.push_back(std::move(draw));
  }

  [[nodiscard]] const validation::EnsembleRow& row() const { return row_; }

 private:
  /// The place of the map is known as well as its alignment says, unless that is not to be known.
  void place_map(const Known& known) {
    simulation::Georeference& georeference = scenario_.city.georeference;
    if (is_known(known, unknowns::Unknown::Map))
      georeference = {};
    else if (alignment_ && georeference.sigma_m == 0 && !arguments_.unsaid)
      georeference.sigma_m = std::hypot(alignment_->sigma_east_m, alignment_->sigma_north_m) / std::sqrt(2.0);
  }

  void simulate_point() {
    Progress progress(fmt::format("{}simulating as it is", prefix_), arguments_.quiet);
    compare_.progress = progress_of(progress);
    point_ = simulate(scenario_.receivers.front());
    row_.part = validation::describe_part(point_, 0, part_.count, part_.name);
    row_.point = headlines({});
  }

  /// Headlines of these runs, by the classes of satellites of the city as it is.
  [[nodiscard]] std::vector<validation::Headline> headlines(
      std::span<const validation::Comparison> runs) const {
    validation::FigureOptions options;
    options.resamples = 0;
    return validation::headlines(validation::figures(point_, 0, part_.count, "", options, runs));
  }

  const EnsembleArguments& arguments_;
  validation::Comparison point_;
  validation::EnsembleRow row_;
};

using Drives = std::vector<std::unique_ptr<EnsembleDrive>>;

std::vector<validation::EnsembleRow> rows_of(const Drives& drives) {
  std::vector<validation::EnsembleRow> rows;
  for (const auto& drive : drives) rows.push_back(drive->row());
  return rows;
}

/// Draws of all drives, one after the other.
void draw_all(const EnsembleArguments& arguments, const unknowns::Draws& draws, const Drives& drives) {
  const std::atomic<bool>& stop = catch_interrupts();
  Progress progress("drawing unknowns", arguments.quiet, "runs");
  const std::size_t total = draws.size() * drives.size();
  progress.update(0, total);
  const Told told = [&stop](std::size_t, std::size_t) {
    if (stop.load()) throw Interrupted{};
  };
  std::size_t done = 0;
  for (std::size_t k = 0; k < draws.size(); ++k) {
    for (const auto& drive : drives) {
      drive->draw(draws, k, told);
      progress.update(++done, total);
    }
  }
}

void write_ensemble(const EnsembleArguments& arguments, const Drives& drives) {
  const std::vector<validation::EnsembleRow> rows = rows_of(drives);
  if (write_results(arguments, [&rows] { return validation::ensemble_json(rows); })) {
    fmt::print("\n{}", validation::ensemble_text(rows));
    warn_of_few_draws(static_cast<std::size_t>(*arguments.draws), "--ensemble");
  }
}

}  // namespace

int run_ensemble(const EnsembleArguments& arguments) {
  return unless_interrupted([&] {
    const Known known = unknowns::unknowns_of(arguments.known);
    const bool listed = validation::is_recording_list(arguments.scenario);
    const Drives drives = drives_of<EnsembleDrive>(arguments, recordings_of(arguments, listed), listed);
    for (const auto& drive : drives) drive->start(known);
    const auto count = static_cast<std::size_t>(*arguments.draws);
    draw_all(arguments, unknowns::Draws(arguments.seed.value_or(1), count, known), drives);
    write_ensemble(arguments, drives);
    return kOk;
  });
}

void warn_of_few_draws(std::size_t count, std::string_view option) {
  if (const auto caution = caution_of_few(count, "draws"))
    print_warnings({fmt::format("{}: write {} {}", *caution, option, kFewestOf90)});
}

Option& add_known(Command& command, std::string& known) {
  return command.add_option(
      "--known", known, "LIST",
      fmt::format("unknowns that are not drawn, of {}", fmt::join(unknowns::names(), ", ")));
}

void add_ensemble_options(Command& command, EnsembleArguments& arguments) {
  command
      .add_option("--ensemble", arguments.draws, "N",
                  "simulate each recording N times with draws of what its scenario leaves open (level of the "
                  "installation, obstacles, facades, place of the map, seed), and print intervals of the "
                  "figures")
      .within(2, 1000)
      .excludes("--seeds")
      .excludes("--runs")
      .excludes("--models")
      .excludes("--ladder")
      .excludes("--view");
  command
      .add_flag("--unsaid", arguments.unsaid,
                "forget what scenarios say about installation, surroundings, obstacles and facades")
      .needs("--ensemble");
  add_known(command, arguments.known).needs("--ensemble");
}

}  // namespace canyon::cli
