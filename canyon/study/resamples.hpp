#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "canyon/study/results.hpp"

// Shared by the tables of a study.

namespace canyon::study {

/// Noise realizations drawn with replacement: places in Group::records.
using Resamples = std::vector<std::vector<std::uint32_t>>;
/// Manifest::bootstrap of them, fewer for many occasions, none for one; the same for equal manifests.
[[nodiscard]] Resamples occasion_resamples(const Manifest& manifest, std::size_t occasions);

/// A field of a CSV line, in quotes where it needs them.
[[nodiscard]] std::string csv_text(const std::string& text);
/// Mean, low and high as three fields of a CSV line; a field without a value is empty.
[[nodiscard]] std::string csv_interval(const std::optional<Estimate>& estimate);

}  // namespace canyon::study
