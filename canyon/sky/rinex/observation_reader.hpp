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

// RINEX, The Receiver Independent Exchange Format: version 2.11 (Gurtner & Estey 2007), table A2; versions
// 3.05 (Romero 2020), tables A2 and A3, and 4.00 (Romero 2021), whose observation files are those of 3.05.

namespace canyon::rinex {

/// The measurements of one signal of a satellite at one epoch: all values belong to one code.
struct ObservedSignal {
  gnss::SatelliteId id;
  /// The entry of gnss::signals_of() for the code; nullptr counts as the first, the one near L1.
  const gnss::Signal* signal = nullptr;
  std::array<char, 3> code{};  ///< band and attribute in RINEX 3 notation: "1C", "2I"; zero-terminated
  std::optional<double> pseudorange_m;
  std::optional<double> carrier_phase_cycles;
  std::optional<double> doppler_hz;  ///< positive while the satellite approaches
  std::optional<double> cn0_dbhz;
  /// C/N0 is the middle of the class of the one-digit indicator (6 dB wide), for lack of an S observation.
  bool cn0_from_indicator = false;
  /// Loss-of-lock indicator of the carrier phase: bit 0 lost lock since the preceding epoch, bit 1 half-cycle
  /// ambiguity, bit 2 antispoofing (2.x) or BOC-tracking of an MBOC signal (3.x). May be set without a phase.
  std::uint8_t loss_of_lock = 0;
  /// Whether the receiver reports multipath, in formats with this flag.
  std::optional<bool> multipath;

  /// Whether it is the signal near L1.
  [[nodiscard]] bool first() const {
    return signal == nullptr || signal == gnss::signals_of(id.system).data();
  }
};

/// A header, with later changes by header records.
struct ObservationHeader {
  std::string format;  ///< name: "RINEX 3.03"
  double version = 0;  ///< of RINEX, for the codes of the signals
  char system = 'G';   ///< of the file: a system's letter, M for mixed
  std::string program, marker, receiver, antenna;
  /// Observation types in column order, by system letter; version 2: one list under ' '.
  std::map<char, std::vector<std::string>> types;
  std::string time_system = "GPS";  ///< of the file's epochs: GPS, GLO (is UTC), GAL, QZS, IRN, BDT
  std::optional<double> interval_s;
  std::optional<geodesy::GpsTime> first, last;               ///< TIME OF FIRST, LAST OBS
  std::optional<Eigen::Vector3d> approximate_position_ecef;  ///< [m]; empty for 0 0 0
  /// The antenna reference point from the marker: height, east, north [m].
  std::optional<Eigen::Vector3d> antenna_delta_hen;
  bool clock_offset_applied = false;  ///< epochs, code and phase are corrected by the clock offset field
  std::map<gnss::SatelliteId, int> glonass_channels;
  /// GLONASS COD/PHS/BIS [m]: to be added to phases, by RINEX 3 code ("1C"); no entry: not known.
  std::map<std::string, double, std::less<>> glonass_bias_m;
  std::optional<int> leap_seconds;
  bool moving = false;  ///< from event 2 to event 3 the antenna moves: its position is not valid

  /// Its antenna, ECEF [m]: the position plus the antenna offset; empty if it has none, or moves.
  [[nodiscard]] std::optional<Eigen::Vector3d> antenna_ecef() const;
};

struct ObservationEpoch {
  geodesy::GpsTime receiver_time;  ///< the receiver's time tag, on GPST for any time system of the file
  bool power_failure = false;      ///< epoch flag 1: between this epoch and the one before
  std::optional<double> receiver_clock_offset_s;  ///< as in the file
  /// Satellites in the file's order, without duplicates, each one's signals in the order of
  /// gnss::signals_of(); may be empty.
  std::vector<ObservedSignal> signals;
  int line = 0;  ///< of the epoch in its file
  /// Shared by the epochs for which it is valid; null in formats without one.
  std::shared_ptr<const ObservationHeader> header;
};

struct ObservationOptions {
  /// Other systems are counted and skipped.
  std::set<gnss::System> systems{gnss::kAllSystems.begin(), gnss::kAllSystems.end()};
  /// All signals of gnss::signals_of(), by signal_codes(); else of each satellite the one near L1.
  bool all_signals = false;
  /// L1-band codes, best first, instead of default_codes(). The pseudorange of the first one that a satellite
  /// has at an epoch is used, and phase, Doppler and C/N0 of the same code.
  std::map<gnss::System, std::vector<std::string>> codes;
  /// Throws InputError for no system at all and for codes that are not a digit and a capital letter.
  void validate() const;
};

/// The open signals near L1 of gnss::l1_frequency_hz(), best first, then the encrypted ones: GPS 1C 1S 1L 1X
/// 1P 1W 1Y, GLONASS 1C 1P, Galileo 1X 1C 1B 1Z, QZSS 1C 1S 1L 1X 1Z 1B, SBAS 1C, BeiDou's B1I: 2I 1I 2X 2Q,
/// and 1X 1Q in files of version 3.02, the only one that calls this band 1 (later 1X is B1C).
[[nodiscard]] std::vector<std::string> default_codes(gnss::System system, double version);

/// Codes of a signal if all signals are read, best first: pilots before data and pilot together, and data
/// alone; L2C: 2L 2S 2X. The first signal: default_codes() without the others'. Table: docs/methods.md.
[[nodiscard]] std::vector<std::string> signal_codes(const gnss::Signal& signal, double version);

/// Counts and warnings about the part of a file read so far.
struct ObservationReport {
  explicit ObservationReport(std::filesystem::path path = {}) : notes(std::move(path)) {}

  std::size_t epochs = 0;              ///< returned (flags 0 and 1)
  std::size_t observations = 0;        ///< signals returned
  std::array<std::size_t, 7> flags{};  ///< epoch records by flag, 0 to 6, including skipped ones
  ReadReport notes;                    ///< damaged records; skipped parts; values out of range
  /// With all signals: codes in the header without a known signal, in the notation of versions 3 and 4, of
  /// wanted systems by letter. Version 2, whose types are for all systems: types, under ' '.
  std::map<char, std::set<std::string>> unknown_codes;

  /// Notes, and unknown codes.
  [[nodiscard]] ReadReport all() const;
  [[nodiscard]] std::vector<std::string> lines() const { return all().lines(); }
  [[nodiscard]] std::vector<std::string> warnings() const { return all().warnings(); }
};

/// Reads observation files of RINEX 2.00 to 2.12, 3.x and 4.x, plain, gzip or in Hatanaka's compression,
/// epoch by epoch in memory that does not grow with the file. Concatenated files, headers included, are read
/// as one. Returns each satellite's L1-band single-frequency set, or all signals
/// (ObservationOptions::all_signals).
///
/// Epoch flags: 0 and 1 are returned; 2 to 5 are events whose header records apply from there on (observation
/// types, scale factors, positions), as do the records of a second header, and each epoch has the header
/// valid at this point (ObservationEpoch::header); 6 (cycle slips) is skipped, because its values repeat
/// others. Damaged records are counted in report(), with file and line, and only they are skipped: a
/// satellite's line with a field that is not a number, a repeated satellite, an unreadable epoch line with
/// all the records below it. An epoch whose time does not follow that of the preceding epoch line is skipped.
/// Version 2's C1 and P1 are returned as "1C" and "1P", 2.12's CA as "1C". BeiDou, defined only in 2.12, is
/// C2 there, returned as "2I"; older files with BeiDou are read with their C1. Version 2's C2 is L2C ("2X")
/// before 2.12, GLONASS's "2C"; C5 and C7 are "5X" and "7X", BeiDou's C7 and C6 "7I" and "6I". Phase, Doppler
/// and strength of version 2 are those of the band, independent of the pseudorange.
class RinexObservationReader {
 public:
  /// Reads the header. Throws InputError if the file is missing, no RINEX observation file, of an unknown
  /// version or time system, or has no wanted pseudorange.
  explicit RinexObservationReader(const std::filesystem::path& path, ObservationOptions options = {});
  /// Text in memory; `name` is its path in messages.
  RinexObservationReader(std::string text, const std::filesystem::path& name,
                         ObservationOptions options = {});
  ~RinexObservationReader();
  RinexObservationReader(RinexObservationReader&&) noexcept;
  RinexObservationReader& operator=(RinexObservationReader&&) noexcept;

  /// The next epoch of flag 0 or 1; empty at the end. Truncated gzip data are read up to the cut, with a line
  /// in report(); throws InputError for damaged gzip data.
  [[nodiscard]] std::optional<ObservationEpoch> next();

  /// The header at the file's begin, with all changes so far.
  [[nodiscard]] const ObservationHeader& header() const;
  [[nodiscard]] const ObservationReport& report() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A whole file.
struct RinexObservations {
  ObservationHeader header;              ///< at the file's begin
  std::vector<ObservationEpoch> epochs;  ///< times strictly increase; report has the skipped ones
  ObservationReport report;
};
/// Throws InputError as the reader does, and if the file has no observation at all.
[[nodiscard]] RinexObservations read_rinex_observations(const std::filesystem::path& path,
                                                        const ObservationOptions& options = {});

/// Observations of a receiver in the file's format, detected by content: RINEX, or a text log of Android's
/// GnssLogger (observation_file.hpp). Throws InputError as the readers do.
[[nodiscard]] RinexObservations read_observations(const std::filesystem::path& path,
                                                  const ObservationOptions& options = {});

// Functions that the readers of recorded observations share, for all formats. Codes of a signal in a file of
// this version, best first; none if the options exclude the signal.
[[nodiscard]] std::vector<std::string> wanted_codes(const ObservationOptions& options,
                                                    const gnss::Signal& signal, double version);

/// "an L1-band observation", "an observation of a known signal".
[[nodiscard]] std::string_view wanted_words(const ObservationOptions& options);

/// The reason for an epoch that RinexObservationReader skips because of its time.
inline constexpr std::string_view kDoesNotFollow = "time of the epoch does not follow the one before";

/// Removes epochs that are not before all later ones, which a stream cannot detect. Throws InputError if
/// these are most of the epochs, and if no observation is left.
void finish_observations(const std::filesystem::path& path, const ObservationOptions& options,
                         RinexObservations& recorded);

}  // namespace canyon::rinex
