#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>

#include "canyon/analysis/validation/comparison.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/fwd.hpp"

namespace canyon::view {
class Probe;
}

namespace canyon::validation {

/// The contents of a view of a validation.
struct ComparisonInput {
  std::string title;
  const simulation::Environment* environment = nullptr;  ///< not null: city, and rays for skylines
  const Comparison* comparison = nullptr;                ///< not null
  std::size_t first = 0, count = 0;                      ///< of its epochs
  double elevation_mask_deg = 0;                         ///< of both fixes
};

/// Writes a comparison as "canyon view 1" into `folder`, which is created if needed (docs/view-format.md):
/// two receivers, "recorded" and "simulated", at the same positions, and their differences as the header's
/// "comparison". Positions are in the unmoved map, as drawn; directions and errors are those of the true
/// world. It has only direct paths. Throws InputError if there is no epoch or the folder is not writable.
void write_comparison(const ComparisonInput& input, const std::filesystem::path& folder);

/// Whether the view in `folder` is of a comparison. Throws InputError if it has no header.
[[nodiscard]] bool is_comparison(const std::filesystem::path& folder);

/// Antennas in the view of a comparison, at its times, with the scenario's first receiver, which is the
/// simulated one; in the city at the scenario's position. Throws InputError if the view has other walls than
/// `scene`, and as Probe does.
[[nodiscard]] std::unique_ptr<view::Probe> comparison_probe(const std::filesystem::path& folder,
                                                            simulation::Scenario scenario,
                                                            std::shared_ptr<simulation::CityScene> scene,
                                                            std::size_t paths_per_satellite);

}  // namespace canyon::validation
