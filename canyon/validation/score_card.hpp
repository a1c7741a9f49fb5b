#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "canyon/validation/recording_table.hpp"

// Which figures of a simulated receiver lie within their range of the recorded ones.

namespace canyon::validation {

/// Whether a headline lies in its range, which docs/realism.md has for twelve of them: tracked shares within
/// 0.1 of the recorded ones, LOS less NLOS within 2 dB, the four Kolmogorov-Smirnov distances at most 0.2,
/// satellites used within 1, Spearman at least 0.6, median difference at most 10 m, p50 and p95 of fixes 0.7
/// to 1.4 of the recorded ones. Empty for others, and where a value is missing.
[[nodiscard]] std::optional<bool> within_range(const Headline& headline);

struct Score {
  std::size_t within = 0, of = 0;  ///< headlines in their range, and that have one
};
[[nodiscard]] Score score_of(const std::vector<Headline>& headlines);

/// A Markdown table: a line for each figure with a range, a column for each recording (pooled rows are left
/// out) with the simulated value, the recorded one in brackets, the 95 % interval of the simulated one where
/// there is one, and yes or no; then how many of each and of all.
[[nodiscard]] std::string score_card(const std::vector<RecordingRow>& rows);

}  // namespace canyon::validation
