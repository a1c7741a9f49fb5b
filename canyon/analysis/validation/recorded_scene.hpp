#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/analysis/validation/comparison.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/simulator.hpp"

// Part of canyon::io.

namespace canyon::validation {

/// One recording of a list, and the data for its comparison.
struct ListedRecording {
  std::string name;  ///< names it in tables, and the folder of its view
  /// Recordings of one class are pooled; empty: not pooled.
  std::string receiver_class;
  std::optional<std::filesystem::path> scenario, obs;  ///< given, as existing files
  std::optional<std::filesystem::path> truth;          ///< empty: the scenario's trajectory or position
  std::string truth_format;  ///< simulation::trajectory_formats(); empty: detected from the file's content
  std::string profile;       ///< instead of the scenario's, for its first receiver; empty: the scenario's
  std::optional<std::filesystem::path> nmea;  ///< fixes reported by the recorded receiver
  bool align = false;                         ///< align the city, using the first part
  bool align_heading = false;                 ///< also align its heading; only with `align`
  std::optional<double> split;                ///< fraction of epochs of the first part, (0, 1)
};
void visit(options::Visitor& v, ListedRecording& r);

/// The recordings that `canyon validate LIST.yaml` evaluates: 1 to 50.
struct RecordingList {
  std::vector<ListedRecording> recordings;
};
void visit(options::Visitor& v, RecordingList& list);

/// Whether a YAML file is such a list, not a scenario: it has the key `recordings`. False if it is not YAML.
/// Throws InputError for a file that cannot be read.
[[nodiscard]] bool is_recording_list(const std::filesystem::path& path);
/// Reads a list; paths of files are relative to its folder. Throws InputError with file and line for syntax,
/// unknown keys (with the closest known one), values out of range, missing files, and two recordings of one
/// name.
[[nodiscard]] RecordingList read_recording_list(const std::filesystem::path& path);

/// A recording in its scenario's city, under the sky of its time.
struct RecordedScene {
  simulation::BuiltSky sky;
  std::unique_ptr<simulation::Environment> environment;
  Recording recording;
};

/// Sets the true positions' file and format from the scenario if `files` does not have them. Throws
/// InputError, with the name of the `option` to give, if the scenario's trajectory is not a file.
void resolve_truth(const simulation::Scenario& scenario, ListedRecording& files, std::string_view option);

/// Loads the scenario's city and reads the observations and, after resolve_truth(), the true positions.
/// simulation::decide_options() decides the receivers' options that depend on the sky's errors. Throws
/// InputError as read_recording(), simulation::load_city() and simulation::build_sky().
[[nodiscard]] RecordedScene read_recorded_scene(simulation::Scenario& scenario, const ListedRecording& files,
                                                bool atmosphere);

/// A scenario's city, resampled under a recording's sky. The map's files are read at the first call.
class ResampledCity {
 public:
  /// The city of `scenario`, sampled by its seed, at its position in the map: the georeference is not
  /// sampled. @param scenario of the same map in every call
  [[nodiscard]] std::unique_ptr<simulation::Environment> draw(const simulation::BuiltSky& sky,
                                                              simulation::Scenario scenario);

 private:
  std::optional<city::City> source_;
};

}  // namespace canyon::validation
