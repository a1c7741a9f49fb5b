#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "canyon/options/fwd.hpp"

namespace canyon::validation {

/// One recording of a list, and what it is compared with.
struct ListedRecording {
  std::string name;  ///< names it in tables, and the folder of its view
  /// Recordings of one class are pooled; empty: with none.
  std::string receiver_class;
  std::optional<std::filesystem::path> scenario, obs;  ///< given, as files that are there
  std::optional<std::filesystem::path> truth;          ///< empty: the scenario's trajectory
  std::string truth_format;  ///< simulation::trajectory_formats(); empty: told by the file's content
  std::string profile;       ///< instead of the scenario's, for its first receiver; empty: the scenario's
  std::optional<std::filesystem::path> nmea;  ///< the recorded receiver's own fixes
  bool align = false;                         ///< the city, by the first part
  bool align_heading = false;                 ///< its heading as well; only with `align`
  std::optional<double> split;                ///< share of epochs of the first part, (0, 1)
};
/// Visits its fields.
void visit(options::Visitor& v, ListedRecording& r);

/// The recordings that `canyon validate LIST.yaml` evaluates: 1 to 50.
struct RecordingList {
  std::vector<ListedRecording> recordings;
};
/// Visits its fields.
void visit(options::Visitor& v, RecordingList& list);

/// Whether a YAML file is such a list and no scenario: it has the key `recordings`. False for what is no
/// YAML.
[[nodiscard]] bool is_recording_list(const std::filesystem::path& path);
/// Reads a list; its files lie where it says, from its own folder. Throws InputError with file and line for
/// syntax, unknown keys (with the closest known one), values out of range, missing files, and two recordings
/// of one name.
[[nodiscard]] RecordingList read_recording_list(const std::filesystem::path& path);

}  // namespace canyon::validation
