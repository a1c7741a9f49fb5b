#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "canyon/analysis/validation/key_metrics.hpp"

// The table of several recordings that `canyon validate LIST.yaml` prints.

namespace canyon::validation {

/// A recording, or all of a class together.
struct RecordingRow {
  std::string name;            ///< "tst", "all mass market"
  std::string receiver_class;  ///< may be empty
  std::vector<KeyMetric> key_metrics;
  // A recording has:
  std::string part;           ///< ModelMetrics::part
  std::string never_tracked;  ///< never_tracked_text()
  std::string metrics_json;   ///< only to_json() of its models
  // A class has:
  std::vector<std::string> pooled;  ///< names of the pooled recordings
};

/// One line that describes a row: "tst (mass market): second half: ... 242 epochs; never tracked ...".
[[nodiscard]] std::string description_of(const RecordingRow& row);

/// A table for terminals: a line for each row and one for its intervals, then the remarks on each recording.
[[nodiscard]] std::string to_text(const std::vector<RecordingRow>& rows);
/// An object: "recordings", an array of their to_json() with "name", "class" and "headlines", and "classes".
[[nodiscard]] std::string to_json(const std::vector<RecordingRow>& rows);

// How many metrics of a simulated receiver are within their range of the recorded ones.

struct Score {
  std::size_t within = 0, of = 0;  ///< key metrics in their range, and those with a range

  Score& operator+=(const Score& other) {
    within += other.within;
    of += other.of;
    return *this;
  }
};
[[nodiscard]] Score score_of(const std::vector<KeyMetric>& key_metrics);

/// The same recordings simulated by several seeds.
struct SeedRows {
  std::uint64_t seed = 0;
  std::vector<RecordingRow> rows;
};
/// A table for terminals: a line for each seed, a column for each recording with the number of metrics within
/// their ranges, and one of all; the mean of all seeds below.
[[nodiscard]] std::string seed_scores(const std::vector<SeedRows>& seeds);

/// A table for terminals: a line for each metric with a range, a column for each recording (without pooled
/// rows) with the simulated value, the recorded one in brackets, the 95 % interval of the simulated one if
/// there is one, and yes or no; then the numbers for each recording and for all.
[[nodiscard]] std::string score_card(const std::vector<RecordingRow>& rows);

}  // namespace canyon::validation
