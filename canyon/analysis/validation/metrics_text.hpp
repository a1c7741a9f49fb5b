#pragma once

#include <optional>
#include <string>
#include <vector>

#include "canyon/analysis/validation/alignment.hpp"
#include "canyon/analysis/validation/metrics.hpp"

namespace canyon::validation {

[[nodiscard]] std::optional<double> auc_of(const std::optional<Separation>& separation);

/// "never tracked above 30 deg in clear view, left out: C07 (412 s), G11 (93 s)"; empty without any.
[[nodiscard]] std::string never_tracked_text(const ModelMetrics& metrics);

/// The metrics as JSON: an object with SI units in the names; null for a metric without data.
/// `alignment_json`, an object by itself, is written under "alignment".
[[nodiscard]] std::string to_json(const std::vector<ModelMetrics>& models,
                                  const std::optional<std::string>& alignment_json);
/// Tables of one model's metrics for terminals.
[[nodiscard]] std::string to_text(const ModelMetrics& metrics);
/// One table for terminals, a row for each model, of the metrics in docs/results.md.
[[nodiscard]] std::string models_table(const std::vector<ModelMetrics>& models);

}  // namespace canyon::validation
