#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "canyon/base/options/describe.hpp"
#include "canyon/run/scenario/scenario.hpp"
#include "canyon/run/unknowns.hpp"
#include "canyon/studies/study/axis.hpp"

namespace canyon::study {

enum class Design : std::uint8_t {
  Grid,           ///< every value of each axis with every value of all others
  Random,         ///< each point drawn alone
  LatinHypercube  ///< of n points each has a stratum of 1/n of every axis for itself
};
enum class Keep : std::uint8_t { Summary, Epochs };

/// A study file: a scenario, and what is varied in it.
struct Study {
  std::filesystem::path file;
  std::string scenario;  ///< its file as written; kInline where it stands in the study
  std::vector<Axis> axes;
  Design design = Design::Grid;
  std::optional<std::uint32_t> runs;  ///< points of a sample
  std::uint64_t seed = 1;             ///< of a sample's points, of drives and of the bootstrap
  Keep keep = Keep::Summary;
  std::optional<double> available_m;  ///< an epoch is available with a fix that is so good; empty: with any
  std::optional<double> along_m;      ///< errors along the way of all runs, in stretches of this length
  std::uint64_t max_runs = 1'000'000;
  double max_output_gb = 20;
  double city_memory_gb = 4;  ///< of cities that are kept for later runs
  double confidence = 0.95;
  std::uint32_t bootstrap = 1000;  ///< resamples behind an interval

  static constexpr const char* kInline = "(in the study)";
};
void visit(options::Visitor& v, Study& o);
[[nodiscard]] const options::Description& study_description();

/// One run before it is made.
struct StudyRun {
  std::size_t number = 0;
  std::vector<AxisValue> at;  ///< one for each axis
  std::uint64_t seed = 0;     ///< of the scenario
  std::string realization;    ///< equal for runs that share their random numbers
};

/// A study made ready: files found, every value of every axis tried in the scenario, runs counted.
class StudyPlan {
 public:
  /// Throws InputError with file and line for a text that is not a study, for a value that the scenario does
  /// not take, and for a study that is larger than its limits.
  [[nodiscard]] static StudyPlan read(const std::filesystem::path& path);
  [[nodiscard]] static StudyPlan parse(const std::string& text, const std::filesystem::path& name);

  [[nodiscard]] const Study& study() const { return study_; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] StudyRun run(std::size_t number) const;
  /// The scenario of a run; with an axis of drives its trajectory is empty until set_drive(). Throws as
  /// simulation::read_scenario(), naming the study where a value of its is to blame.
  [[nodiscard]] simulation::Scenario scenario(const StudyRun& run) const;
  /// Names of all receivers of all runs.
  [[nodiscard]] const std::vector<std::string>& receivers() const { return receivers_; }
  /// Hash of all that results depend on, contents of files among it, and not where these lie.
  [[nodiscard]] const std::string& key() const { return key_; }
  /// Bytes of the results, about.
  [[nodiscard]] double estimated_bytes() const { return bytes_; }
  [[nodiscard]] double epochs_per_run() const { return epochs_; }
  /// Of the file of the trajectory.
  [[nodiscard]] const ReadReport& report() const { return report_; }
  /// The axis of drives, or nothing.
  [[nodiscard]] const Axis* drives() const;
  /// Whether runs are grouped by this axis for comparisons: it holds settings, and each of its
  /// listed values has many runs.
  [[nodiscard]] bool groups(const Axis& axis) const;

 private:
  void read_axes(const options::Node& root);
  void make_points();
  void try_values();
  void check_size() const;
  [[nodiscard]] options::Document document(const std::vector<AxisValue>& at) const;
  void draw_unknowns(const StudyRun& run, simulation::Scenario& scenario) const;

  Study study_;
  options::Node base_;  // the scenario's tree
  std::filesystem::path base_file_;
  std::vector<std::vector<double>> samples_;  // [axis][point], of axes that are drawn
  std::size_t points_ = 1, size_ = 0;
  std::optional<unknowns::Draws> draws_;  // of an axis of unknowns
  std::vector<std::string> receivers_;
  std::string key_;
  double bytes_ = 0, epochs_ = 0;
  ReadReport report_;
};

}  // namespace canyon::study
