#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "canyon/validation/comparison.hpp"

// Samples that the pictures of a report are drawn from.

namespace canyon::validation {

/// One quantity, measured and simulated.
struct SamplePair {
  std::vector<double> measured, simulated;
};

/// Values of epochs [first, first + count) of a comparison, in order of time.
struct ReportSamples {
  SamplePair error_los_m, error_nlos_m;  ///< pseudorange errors by the city's word
  SamplePair horizontal_m;               ///< of fixes
};
[[nodiscard]] ReportSamples report_samples(const Comparison& comparison, std::size_t first,
                                           std::size_t count);

/// Satellites of one epoch.
[[nodiscard]] std::span<const ComparedSatellite> satellites_of(const Comparison& comparison,
                                                               const ComparedEpoch& epoch);

/// Horizontal length of a fix's error [m]; empty without a fix.
[[nodiscard]] std::optional<double> horizontal_error_m(const ComparedFix& fix);

/// The epoch of [first, first + count) with most measured satellites, the one nearest to the middle of those
/// with equally many. count > 0 (asserted).
[[nodiscard]] std::size_t richest_epoch(const Comparison& comparison, std::size_t first, std::size_t count);

/// "12:54:03" on the GPS time scale.
[[nodiscard]] std::string clock_gpst(geodesy::GpsTime time);

}  // namespace canyon::validation
