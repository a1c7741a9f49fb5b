#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/sky/rinex/observation_reader.hpp"

namespace canyon::rinex {

// Functions that the readers of recorded observations share, whatever their format.
/// Codes that a signal is read of in a file of this version, best first; none where the options do not want
/// the signal.
[[nodiscard]] std::vector<std::string> wanted_codes(const ObservationOptions& options,
                                                    const gnss::Signal& signal, double version);

/// "an L1-band observation", "an observation of a known signal".
[[nodiscard]] std::string_view wanted_words(const ObservationOptions& options);

/// The reason why RinexObservationReader leaves an epoch out by its time.
inline constexpr std::string_view kDoesNotFollow = "time of the epoch does not follow the one before";

/// Leaves out epochs that are not before all behind them, which a stream cannot know. Throws InputError where
/// that are most, and where no observation is left.
void finish_observations(const std::filesystem::path& path, const ObservationOptions& options,
                         RinexObservations& recorded);

}  // namespace canyon::rinex
