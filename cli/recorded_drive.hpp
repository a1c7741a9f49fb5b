#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/analysis/validation/alignment.hpp"
#include "canyon/analysis/validation/metrics.hpp"
#include "canyon/analysis/validation/recorded_scene.hpp"
#include "canyon/analysis/validation/recording_table.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "cli/arguments.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {

class ProgressLine;

/// Block resamples for the intervals of a table of recordings; each computes all metrics.
inline constexpr int kResamples = 200;

/// Arguments of commands that read recordings.
struct DriveArguments {
  std::string scenario, obs, truth, format, nmea, part;
  std::string json;  ///< file for the results; "-" is standard output
  bool align = false, no_atmosphere = false, all_satellites = false, quiet = false;
  std::optional<double> split;
  validation::AlignOptions alignment;
  std::optional<std::uint64_t> seed;
  int threads = 0;
};
/// Adds SCENARIO|LIST and the options of one recording, of alignment, --seed and --threads.
void add_drive_options(Command& command, DriveArguments& arguments);
/// The recordings of a list, or the one of the command line.
[[nodiscard]] std::vector<validation::ListedRecording> recordings_of(const DriveArguments& arguments,
                                                                     bool listed);

/// Writes the results to --json. Returns whether to print them as text too: not with --json - or --quiet.
[[nodiscard]] bool write_results(const DriveArguments& arguments, const std::function<std::string()>& json);

/// A recording with its scenario: city, sky, truth, the city's position. Prints its steps on standard error.
class RecordedDrive {
  const DriveArguments& arguments_;

 public:
  /// Checks that need no city, before one is loaded. @param listed among others, by its name
  RecordedDrive(const DriveArguments& arguments, const validation::ListedRecording& recording, bool listed);
  /// Reads everything, chooses the parts, and aligns the city if requested.
  void load();

  [[nodiscard]] const validation::ListedRecording& recorded() const { return recorded_; }
  [[nodiscard]] std::string alignment_text() const;
  /// The recording's name and alignment_text(); empty if its city is not aligned.
  [[nodiscard]] std::string alignment_line() const {
    return alignment_ ? prefix_ + alignment_text() : std::string();
  }

 protected:
  /// Epochs of a recording, and their name.
  struct Part {
    std::size_t first = 0, count = 0;
    std::string name;
  };

  void note(const std::string& text) const;
  void warn(const std::vector<std::string>& lines) const;
  [[nodiscard]] std::function<void(std::size_t, std::size_t)> progress_of(ProgressLine& progress) const;
  /// Simulates a receiver at the recording's epochs, by compare_, in the aligned city. The first call finds
  /// the satellites that the recording never tracks; later calls leave them out, without --all-satellites.
  [[nodiscard]] validation::Comparison simulate(const simulation::ReceiverConfig& receiver);
  /// The same with another city, city position and seed, without the never tracked satellites found so far.
  [[nodiscard]] validation::Comparison simulate(const simulation::ReceiverConfig& receiver,
                                                const simulation::Environment& environment,
                                                const validation::Registration& position,
                                                std::uint64_t seed) const;
  /// Metrics of a part of such a comparison. @param runs as for validation::metrics()
  [[nodiscard]] validation::ModelMetrics metrics_of(
      const validation::Comparison& comparison, const Part& part,
      const std::vector<validation::Comparison>& runs = {}) const;
  /// Adds the metrics of the fixes that the recorded receiver reported, if the recording has them.
  void add_reported_fixes(validation::ModelMetrics& metrics, const validation::Comparison& comparison) const;
  /// Its row in a table of several recordings, without JSON.
  [[nodiscard]] validation::RecordingRow row_of(const std::string& name,
                                                const validation::ModelMetrics& metrics,
                                                const validation::Comparison& comparison,
                                                const std::vector<validation::Comparison>& runs) const;
  /// The city of a scenario, sampled by its seed, at its position in the map, under the recording's sky. The
  /// first call reads the city's files again; later calls sample from that city.
  [[nodiscard]] std::unique_ptr<simulation::Environment> sampled_environment(simulation::Scenario scenario);
  [[nodiscard]] validation::Registration registration() const {
    return alignment_ ? alignment_->registration : validation::Registration{};
  }
  /// registration(), moved by a sample of a georeference.
  [[nodiscard]] validation::Registration registration(const simulation::Georeference& georeference,
                                                      std::uint64_t seed) const;

  validation::ListedRecording recorded_;
  std::string prefix_;  ///< of messages, among several recordings
  const std::atomic<bool>& stop_;
  simulation::Scenario scenario_;
  validation::AlignOptions align_options_;
  simulation::BuiltSky sky_;
  std::unique_ptr<simulation::Environment> environment_;
  validation::Recording recording_;
  Part first_part_;  ///< used to align the city
  Part part_;        ///< used for the metrics
  std::string aligned_by_;
  std::optional<validation::CityAlignment> alignment_;
  validation::CompareOptions compare_;

 private:
  [[nodiscard]] simulation::Scenario read_scenario() const;
  void check();
  void read();
  void choose_parts();
  void align();

  validation::ResampledCity redrawn_;
  std::optional<std::vector<validation::NeverTracked>> never_tracked_;  ///< empty until known
};

/// A drive for each of these recordings.
template <typename Drive, typename Arguments>
std::vector<std::unique_ptr<Drive>> drives_of(const Arguments& arguments,
                                              const std::vector<validation::ListedRecording>& recordings,
                                              bool listed) {
  std::vector<std::unique_ptr<Drive>> drives;
  drives.reserve(recordings.size());
  for (const validation::ListedRecording& recording : recordings)
    drives.push_back(std::make_unique<Drive>(arguments, recording, listed));
  return drives;
}

}  // namespace canyon::cli
