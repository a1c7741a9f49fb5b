#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "canyon/simulation/environment.hpp"
#include "canyon/validation/comparison.hpp"

namespace canyon::view {

/// What a view of a validation shows.
struct ComparisonInput {
  std::string title;
  const simulation::Environment* environment = nullptr;  ///< not null: city, and rays for skylines
  const validation::Comparison* comparison = nullptr;    ///< not null
  std::size_t first = 0, count = 0;                      ///< of its epochs
  double elevation_mask_deg = 0;                         ///< of both fixes
};

/// Writes a comparison as "canyon view 1" into `folder`, which is made where needed (docs/view-format.md):
/// two receivers, "recorded" and "simulated", at the same places, and what they differ by as the header's
/// "comparison". Places are those in the unmoved map, right over the city as it is drawn; directions and
/// errors those of the true world. Of paths there are the direct ones alone. Throws InputError where there is
/// no epoch or the folder does not take the files.
void write_comparison(const ComparisonInput& input, const std::filesystem::path& folder);

}  // namespace canyon::view
