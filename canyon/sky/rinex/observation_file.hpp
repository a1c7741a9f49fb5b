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

/// Reads the "Raw" lines of a text log of Android's GnssLogger as epochs of observations; SBAS and NavIC are
/// left out. Sources: the documentation of android.location's GnssMeasurement and GnssClock; GSA, Using GNSS
/// Raw Measurements on Android Devices (2017), 2.4.
///
/// An epoch is tagged with TimeNanos - (FullBiasNanos + BiasNanos). The bias is that of the epoch where the
/// clock began and is held until HardwareClockDiscontinuityCount changes or the stated bias is 10 ms away:
/// then the next epoch has power_failure. So tags, pseudoranges and phases hold the drift of the phone's
/// oscillator, as those of a receiver that does not steer its clock.
///
/// Pseudorange: c (tag in the system's time - ReceivedSvTimeNanos), modulo what State leaves open: a week
/// (time of week), a day (GLONASS), 6 s (subframe), 2 s (page, string), 0.6 s (subframe of BeiDou's D2) or
/// 100 ms (secondary code of E1C). Without code lock a line is no observation; with a shorter span, with an
/// ambiguous millisecond, or with a standard deviation above 500 ns it has no pseudorange. Resolution: 1 ns,
/// 0.3 m. Carrier phase: AccumulatedDeltaRangeMeters over the wavelength where its state is valid and its
/// standard deviation is 0.3 m or less; a reset or a cycle slip sets the loss-of-lock indicator, a half cycle
/// that is reported as open its bit. Doppler: -PseudorangeRateMetersPerSecond over the wavelength, up to 10
/// m/s of standard deviation. All refer to the tag, TimeOffsetNanos is taken off by the rate. Signals by
/// CarrierFrequencyHz (near L1 without one) and CodeType (the signal's usual code without one).
///
/// Lines whose values are no numbers, or impossible, are counted in the report and left out. Throws
/// InputError for a log without any "Raw" line, saying which it has.
[[nodiscard]] RinexObservations read_android_observations(const std::filesystem::path& path,
                                                          const ObservationOptions& options = {});

}  // namespace canyon::rinex
