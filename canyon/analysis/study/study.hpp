#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "canyon/analysis/study/axis.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/unknowns/unknowns.hpp"

namespace canyon::study {

enum class Design : std::uint8_t {
  Grid,           ///< every value of each axis with every value of all others
  Random,         ///< each point is sampled independently
  LatinHypercube  ///< of n points, each is alone in its stratum of 1/n of every axis
};
enum class Retention : std::uint8_t { Summary, Epochs };

/// A study file: a scenario, and its varied parameters.
struct Study {
  std::filesystem::path file;
  std::string scenario;  ///< its file as written; kInline if it is part of the study's file
  std::vector<Axis> axes;
  Design design = Design::Grid;
  std::optional<std::uint32_t> runs;  ///< points of a sample
  std::uint64_t seed = 1;             ///< of a sample's points, of drives and of the bootstrap
  Retention keep = Retention::Summary;
  std::optional<double> available_m;  ///< largest error of an available epoch; empty: any fix is available
  std::optional<double> along_m;      ///< errors along the route of all runs, in segments of this length
  std::uint64_t max_runs = 1'000'000;
  double max_output_gb = 20;
  double city_memory_gb = 4;  ///< of cities that are cached for later runs
  double confidence = 0.95;
  std::uint32_t bootstrap = 1000;  ///< resamples for an interval

  static constexpr const char* kInline = "(in the study)";
};
void visit(options::Visitor& v, Study& o);
[[nodiscard]] const options::Description& study_description();

/// One run before it is computed.
struct StudyRun {
  std::size_t number = 0;
  std::vector<AxisValue> at;  ///< one for each axis
  std::uint64_t seed = 0;     ///< of the scenario
  std::string realization;    ///< equal for runs that share their random numbers
};

/// A study ready to run: files found, every value of every axis checked in the scenario, runs counted.
class StudyPlan {
 public:
  /// Throws InputError with file and line for a text that is not a study, for a value that is invalid in the
  /// scenario, and for a study that exceeds its limits.
  [[nodiscard]] static StudyPlan read(const std::filesystem::path& path);
  [[nodiscard]] static StudyPlan parse(const std::string& text, const std::filesystem::path& name);

  [[nodiscard]] const Study& study() const { return study_; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] StudyRun run(std::size_t number) const;
  /// The scenario of a run; with an axis of drives its trajectory is empty until set_drive(). Throws as
  /// simulation::read_scenario(), with the study's name if one of its values is the cause.
  [[nodiscard]] simulation::Scenario scenario(const StudyRun& run) const;
  /// Names of all receivers of all runs.
  [[nodiscard]] const std::vector<std::string>& receivers() const { return receivers_; }
  /// Hash of all inputs of the results, including contents of files, but not their paths.
  [[nodiscard]] const std::string& key() const { return key_; }
  /// Approximate bytes of the results.
  [[nodiscard]] double estimated_bytes() const { return bytes_; }
  [[nodiscard]] double epochs_per_run() const { return epochs_; }
  /// Report of the reader of the trajectory's file.
  [[nodiscard]] const ReadReport& report() const { return report_; }
  /// The axis of drives, or null.
  [[nodiscard]] const Axis* drives() const;
  /// Whether runs are grouped by this axis for comparisons: it has settings, and each of its listed values
  /// has many runs.
  [[nodiscard]] bool groups(const Axis& axis) const;

 private:
  void read_axes(const options::Node& root);
  void make_points();
  void try_values();
  void check_size() const;
  [[nodiscard]] options::Document document(const std::vector<AxisValue>& at) const;

  Study study_;
  options::Node base_;  // the scenario's tree
  std::filesystem::path base_file_;
  std::vector<std::vector<double>> samples_;  // [axis][point], of sampled axes
  std::size_t points_ = 1, size_ = 0;
  std::optional<unknowns::UnknownSamples> unknown_samples_;  // of an axis of unknowns
  std::vector<std::string> receivers_;
  std::string key_;
  double bytes_ = 0, epochs_ = 0;
  ReadReport report_;
};

}  // namespace canyon::study
