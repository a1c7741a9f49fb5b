#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/read_report.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"
#include "canyon/sky/gnss/signals.hpp"

// RINEX, The Receiver Independent Exchange Format: version 2.11 (Gurtner & Estey 2007), table A2;
// versions 3.05 (Romero 2020), tables A2 and A3, and 4.00 (Romero 2021), whose observation files are those
// of 3.05.

namespace canyon::rinex {

/// The measurements of one signal of a satellite at one epoch: all values belong to one code.
struct ObservedSignal {
  gnss::SatelliteId id;
  /// The entry of gnss::signals_of() that the code is read as; nullptr counts as the first, the one near L1.
  const gnss::Signal* signal = nullptr;
  std::array<char, 3> code{};  ///< band and attribute as RINEX 3 writes them: "1C", "2I"; zero-terminated
  std::optional<double> pseudorange_m;
  std::optional<double> carrier_phase_cycles;
  std::optional<double> doppler_hz;  ///< positive while the satellite approaches
  std::optional<double> cn0_dbhz;
  /// C/N0 is the middle of the class that the one-digit indicator stands for (6 dB wide), for want of an S
  /// observation.
  bool cn0_from_indicator = false;
  /// Loss-of-lock indicator of the carrier phase: bit 0 lost lock since the epoch before, bit 1 half-cycle
  /// ambiguity, bit 2 antispoofing (2.x) or BOC-tracking of an MBOC signal (3.x). It may be set where the
  /// phase itself is missing.
  std::uint8_t loss_of_lock = 0;
  /// The receiver's own judgement whether it sees multipath, in formats that have one.
  std::optional<bool> multipath;

  /// Whether it is the one near L1.
  [[nodiscard]] bool first() const {
    return signal == nullptr || signal == gnss::signals_of(id.system).data();
  }
};

/// A header, with the changes by header records below it.
struct ObservationHeader {
  std::string format;  ///< for people: "RINEX 3.03"
  double version = 0;  ///< of RINEX, whose codes the signals have
  char system = 'G';   ///< of the file: a system's letter, M for mixed
  std::string program, marker, receiver, antenna;
  /// Observation types in column order, by system letter; version 2: one list under ' '.
  std::map<char, std::vector<std::string>> types;
  std::string time_system = "GPS";  ///< of the file's epochs: GPS, GLO (is UTC), GAL, QZS, IRN, BDT
  std::optional<double> interval_s;
  std::optional<geodesy::GpsTime> first, last;               ///< TIME OF FIRST, LAST OBS
  std::optional<Eigen::Vector3d> approximate_position_ecef;  ///< [m]; empty where the file says 0 0 0
  /// The antenna reference point from the marker: height, east, north [m].
  std::optional<Eigen::Vector3d> antenna_delta_hen;
  bool clock_offset_applied = false;  ///< epochs, code and phase are corrected by the clock offset field
  std::map<gnss::SatelliteId, int> glonass_channels;
  /// GLONASS COD/PHS/BIS [m]: to be added to phases, by RINEX 3 code ("1C"); no entry: not known.
  std::map<std::string, double, std::less<>> glonass_bias_m;
  std::optional<int> leap_seconds;
  bool moving = false;  ///< from event 2 to event 3 the antenna moves: its position no longer holds

  /// Its antenna, ECEF [m]: the position, and the antenna from there; empty where it has none, or moves.
  [[nodiscard]] std::optional<Eigen::Vector3d> antenna_ecef() const;
};

struct ObservationEpoch {
  geodesy::GpsTime receiver_time;  ///< the receiver's time tag, on GPST whatever the file's time system
  bool power_failure = false;      ///< epoch flag 1: between this epoch and the one before
  std::optional<double> receiver_clock_offset_s;  ///< as the file gives it
  /// Satellites in the file's order, none twice, each one's signals in the order of gnss::signals_of(); may
  /// be empty.
  std::vector<ObservedSignal> signals;
  int line = 0;  ///< of the epoch in its file
  /// Shared by the epochs for which it holds; null in formats without one.
  std::shared_ptr<const ObservationHeader> header;
};

struct ObservationOptions {
  /// Others are counted and left out.
  std::set<gnss::System> systems{gnss::kAllSystems.begin(), gnss::kAllSystems.end()};
  /// Every signal that gnss::signals_of() knows, by signal_codes(); else of each satellite the one near L1.
  bool all_signals = false;
  /// L1-band codes, best first, for systems that shall not have default_codes(). The pseudorange of the first
  /// one that a satellite has at an epoch is taken, and phase, Doppler and C/N0 of the same.
  std::map<gnss::System, std::vector<std::string>> codes;
  /// Throws InputError for no system at all and for codes that are not a digit and a capital letter.
  void validate() const;
};

/// The open signals near L1 that gnss::l1_frequency_hz() speaks of, best first, then the encrypted ones:
/// GPS 1C 1S 1L 1X 1P 1W 1Y, GLONASS 1C 1P, Galileo 1X 1C 1B 1Z, QZSS 1C 1S 1L 1X 1Z 1B, SBAS 1C, BeiDou's
/// B1I: 2I 1I 2X 2Q, and 1X 1Q where the file is of version 3.02, which alone calls that band 1 (later 1X is
/// B1C, of another frequency).
[[nodiscard]] std::vector<std::string> default_codes(gnss::System system, double version);

/// Codes that are read as a signal where all are, best first: pilots before data and pilot together, and data
/// alone; L2C: 2L 2S 2X. The first signal's are default_codes() less those of the others. docs/methods.md
/// has the table.
[[nodiscard]] std::vector<std::string> signal_codes(const gnss::Signal& signal, double version);

/// Counts and warnings about a file, as far as it was read.
struct ObservationReport {
  explicit ObservationReport(std::filesystem::path path = {}) : notes(std::move(path)) {}

  std::size_t epochs = 0;              ///< given (flags 0 and 1)
  std::size_t observations = 0;        ///< signals given
  std::array<std::size_t, 7> flags{};  ///< epoch records by flag, 0 to 6, those left out included
  ReadReport notes;                    ///< damaged records; what is passed over; values out of range
  /// With all signals: codes in the header of which no signal is known, as versions 3 and 4 write them, of
  /// wanted systems by letter. Version 2, whose types are all systems': types, under ' '.
  std::map<char, std::set<std::string>> unknown_codes;

  /// Notes, and codes that are not known.
  [[nodiscard]] ReadReport all() const;
  [[nodiscard]] std::vector<std::string> lines() const { return all().lines(); }
  [[nodiscard]] std::vector<std::string> warnings() const { return all().warnings(); }
};

/// Reads observation files of RINEX 2.00 to 2.12, 3.x and 4.x, plain, gzip or in Hatanaka's compression,
/// epoch by epoch in memory that does not grow with the file. Files that were joined, headers included, are
/// read as one. Gives each satellite's L1-band single-frequency set, or all signals
/// (ObservationOptions::all_signals).
///
/// Epoch flags: 0 and 1 are given; 2 to 5 are events whose header records are applied from there on
/// (observation types, scale factors, positions), as are the records of a second header, and each epoch has
/// the header that holds there (ObservationEpoch::header); 6 (cycle slips) is passed over, as its values
/// repeat others. Damaged records are counted in report(), with file and line, and left out alone: a
/// satellite's line with a field that is not a number, a satellite twice, an unreadable epoch line with all
/// the records below it. An epoch whose time does not follow that of the epoch line before is left out.
/// Version 2's C1 and P1 are given as "1C" and "1P", 2.12's CA as "1C". BeiDou, which 2.12 alone knows, is C2
/// there, given as "2I"; older files that have it all the same are read with their C1. Version 2's C2 is L2C
/// ("2X") before 2.12, GLONASS's "2C"; C5 and C7 are "5X" and "7X", BeiDou's C7 and C6 "7I" and "6I". Phase,
/// Doppler and strength of version 2 are those of the band, whichever pseudorange it has them beside.
class RinexObservationReader {
 public:
  /// Reads the header. Throws InputError where the file is missing, no RINEX observation file, of an
  /// unknown version or time system, or has no pseudorange that is wanted.
  explicit RinexObservationReader(const std::filesystem::path& path, ObservationOptions options = {});
  /// Text in memory; `name` stands for its path in messages.
  RinexObservationReader(std::string text, const std::filesystem::path& name,
                         ObservationOptions options = {});
  ~RinexObservationReader();
  RinexObservationReader(RinexObservationReader&&) noexcept;
  RinexObservationReader& operator=(RinexObservationReader&&) noexcept;

  /// The next epoch of flag 0 or 1; empty at the end. Gzip data that end early are read up to there, with a
  /// line in report(); throws InputError for gzip data that is damaged.
  [[nodiscard]] std::optional<ObservationEpoch> next();

  /// That of the file's begin, with all changes so far.
  [[nodiscard]] const ObservationHeader& header() const;
  [[nodiscard]] const ObservationReport& report() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A whole file.
struct RinexObservations {
  ObservationHeader header;              ///< at the file's begin
  std::vector<ObservationEpoch> epochs;  ///< times strictly increase unless report says what was left out
  ObservationReport report;
};
/// Throws InputError as the reader does, and where the file holds no observation at all.
[[nodiscard]] RinexObservations read_rinex_observations(const std::filesystem::path& path,
                                                        const ObservationOptions& options = {});

/// Observations of a receiver in whichever format the file has, by its content: RINEX, or a text log of
/// Android's GnssLogger (observation_file.hpp). Throws InputError as the readers do.
[[nodiscard]] RinexObservations read_observations(const std::filesystem::path& path,
                                                  const ObservationOptions& options = {});

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
