#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/rinex/observation_reader.hpp"

// Functions that the readers of recorded observations share, whatever their format.

namespace canyon::rinex {

/// Codes that a signal is read of in a file of this version, best first; none where the options do not want
/// the signal.
[[nodiscard]] std::vector<std::string> wanted_codes(const ObservationOptions& options,
                                                    const gnss::Signal& signal, double version);

/// "an L1-band observation", "an observation of a known signal".
[[nodiscard]] std::string_view wanted_words(const ObservationOptions& options);

/// Leaves out epochs whose times contradict those around them, and single pseudoranges and carrier phases
/// that do by more than 1 km, which a stream cannot know. Throws InputError where no observation is left.
void finish_observations(const std::filesystem::path& path, const ObservationOptions& options,
                         RinexObservations& recorded);

}  // namespace canyon::rinex
