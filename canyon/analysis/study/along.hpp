#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "canyon/analysis/study/compare.hpp"

namespace canyon::study {

/// A segment of the route that all runs of a group follow.
struct Stretch {
  double from_m = 0, to_m = 0;
  std::size_t epochs = 0;  ///< of all runs
  double available = 0;    ///< fraction of these with a fix
  /// Horizontal errors of all its epochs with a fix [m], with intervals over noise realizations.
  std::optional<MeanEstimate> median, p95;
};
/// Errors along the route, in segments of Manifest::along_m, one list for each group; reads the runs' epochs
/// one after the other. Quantiles are of all runs' epochs together; intervals as in compare(), by resampling
/// whole runs with replacement, since errors of one drive are correlated. Beyond 10,000 segments: InputError.
[[nodiscard]] std::vector<std::vector<Stretch>> errors_along(const Manifest& manifest,
                                                             const GroupComparison& comparison,
                                                             std::vector<std::optional<RunRecord>>& records,
                                                             const std::filesystem::path& folder);
/// A line for each group and segment.
[[nodiscard]] std::string along_csv(const GroupComparison& comparison,
                                    const std::vector<std::vector<Stretch>>& along);

}  // namespace canyon::study
