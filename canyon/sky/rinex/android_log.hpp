#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"

// Text logs of Android's GnssLogger: its LOGGING_FORMAT.md, and the documentation of android.location's
// GnssMeasurement and GnssClock, which defines the values and bits of the columns.

namespace canyon::rinex {

/// Bits of the column State, and the numbers of ConstellationType.
namespace android {
enum State : std::uint32_t {
  kCodeLock = 1U << 0U,
  kBitSync = 1U << 1U,
  kSubframeSync = 1U << 2U,
  kTowDecoded = 1U << 3U,
  kMillisecondAmbiguous = 1U << 4U,
  kSymbolSync = 1U << 5U,
  kGlonassStringSync = 1U << 6U,
  kGlonassTimeOfDayDecoded = 1U << 7U,
  kD2BitSync = 1U << 8U,
  kD2SubframeSync = 1U << 9U,
  kE1CodeLock = 1U << 10U,
  kE1SecondaryCodeLock = 1U << 11U,
  kE1PageSync = 1U << 12U,
  kTowKnown = 1U << 14U,
  kGlonassTimeOfDayKnown = 1U << 15U,
  kSecondaryCodeLock = 1U << 16U,
};
/// Bits of the column AccumulatedDeltaRangeState.
enum DeltaRangeState : std::uint32_t {
  kValid = 1,
  kReset = 2,
  kCycleSlip = 4,
  kHalfCycleResolved = 8,
  kHalfCycleReported = 16
};
enum Constellation : std::uint8_t {
  kGps = 1,
  kSbas = 2,
  kGlonass = 3,
  kQzss = 4,
  kBeiDou = 5,
  kGalileo = 6,
  kNavIc = 7
};
/// QZSS numbers are PRNs: the number of J01 plus this offset. GLONASS satellites with an unknown slot have
/// their frequency channel plus 100.
inline constexpr int kQzssOffset = 192;
}  // namespace android

/// The number of lines of each kind ("Raw", "Fix", "Status") in a log.
[[nodiscard]] std::map<std::string, std::size_t> android_log_kinds(const std::filesystem::path& path);
/// "Fix 243, Status 80"; "no line" for an empty log.
[[nodiscard]] std::string android_log_kinds_text(const std::filesystem::path& path);

/// The lines of one kind in such a log. Versions of the app differ in columns and their order: the header
/// names them ("# Raw,utcTimeMillis,TimeNanos,...") and may be repeated.
class AndroidLog {
 public:
  /// @param columns wanted, by name, separated by blanks; names of older versions follow after '|'. Both
  /// texts must outlive this object.
  AndroidLog(TextFile file, std::string_view kind, std::string_view columns)
      : file_(std::move(file)), kind_(kind), names_(split_blanks(columns)) {}

  /// Goes to the next line of the kind; false at the end. Throws InputError for a line before any header.
  [[nodiscard]] bool next();

  /// Field of a column (number among `columns`) without blanks; empty if the line or header lacks it.
  [[nodiscard]] std::string_view text(std::size_t column) const;
  /// Empty for a field that is empty or not an integer.
  [[nodiscard]] std::optional<long long> integer(std::size_t column) const;
  [[nodiscard]] std::optional<double> number(std::size_t column) const;
  /// Name of a column in the newest version of the app.
  [[nodiscard]] std::string_view name(std::size_t column) const;
  /// Whether the header has the column.
  [[nodiscard]] bool has(std::size_t column) const { return column < at_.size() && at_[column] >= 0; }

  [[nodiscard]] const TextFile& file() const { return file_; }
  /// "Google Pixel 7" and "v3.0.6.4", if the header has them.
  [[nodiscard]] const std::string& device() const { return device_; }
  [[nodiscard]] const std::string& version() const { return version_; }

 private:
  void read_columns(std::string_view line);
  void read_version(std::string_view comment);

  TextFile file_;
  std::string_view kind_;
  std::vector<std::string_view> names_;
  std::vector<int> at_;  ///< index of each column in a line; -1: missing
  std::vector<std::string_view> fields_;
  std::string device_, version_;
};

/// Reads the "Raw" lines of a text log of Android's GnssLogger as epochs of observations, without SBAS and
/// NavIC. Sources: the documentation of android.location's GnssMeasurement and GnssClock; GSA, Using GNSS Raw
/// Measurements on Android Devices (2017), 2.4.
///
/// An epoch is tagged with TimeNanos - (FullBiasNanos + BiasNanos). The bias is taken at the first epoch of
/// the clock and held until HardwareClockDiscontinuityCount changes or the reported bias differs by 10 ms;
/// then the next epoch has power_failure. So tags, pseudoranges and phases contain the drift of the phone's
/// oscillator, as for a receiver that does not steer its clock.
///
/// Pseudorange: c (tag in the system's time - ReceivedSvTimeNanos), modulo the ambiguity that State leaves: a
/// week (time of week), a day (GLONASS), 6 s (subframe), 2 s (page, string), 0.6 s (subframe of BeiDou's D2)
/// or 100 ms (secondary code of E1C). A line without code lock is no observation; with a shorter span, with
/// an ambiguous millisecond, or with a standard deviation above 500 ns it has no pseudorange. Resolution: 1
/// ns, 0.3 m. Carrier phase: AccumulatedDeltaRangeMeters over the wavelength if its state is valid and its
/// standard deviation is 0.3 m or less; a reset or a cycle slip sets the loss-of-lock indicator, an
/// unresolved half cycle its bit. Doppler: -PseudorangeRateMetersPerSecond over the wavelength, up to 10 m/s
/// of standard deviation. All refer to the tag; TimeOffsetNanos is removed with the rate. Signals follow from
/// CarrierFrequencyHz (near L1 without one) and CodeType (the signal's usual code without one).
///
/// Lines with invalid or impossible values are counted in the report and skipped. Throws InputError for a log
/// without any "Raw" line, with the kinds of lines that it has.
[[nodiscard]] RinexObservations read_android_observations(const std::filesystem::path& path,
                                                          const ObservationOptions& options = {});

}  // namespace canyon::rinex
