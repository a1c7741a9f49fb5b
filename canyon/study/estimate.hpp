#pragma once

#include <string>
#include <vector>

#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/study/axis.hpp"

namespace canyon::study {

/// Bytes of results for each run and receiver, and for each epoch of these where epochs are kept; counted
/// once with the records and the NetCDF file of a study, rounded up.
inline constexpr double kBytesOfSummary = 1000, kBytesOfEpoch = 76;

/// Epochs of a run, about: by duration_s, or the length of the way. @param drives of the study, or null
/// @param warnings receives those about the file of a trajectory
[[nodiscard]] double estimated_epochs(const simulation::Scenario& scenario, const Axis* drives,
                                      std::vector<std::string>& warnings);

}  // namespace canyon::study
