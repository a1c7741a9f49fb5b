#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::rinex {

/// The part of the RINEX navigation reader that converts the lines of one record to an ephemeris.

/// Reason why a record is rejected: thrown by the decoders, caught by the reader, which adds file and line.
struct DamagedRecord {
  std::string reason;
};

/// Column layout of a record.
enum class RecordLayout {
  kVersion2,  ///< " 1 12 10 31  0  0  0.0" then values from column 22; following lines from column 3
  kVersion3,  ///< "G01 2019 04 27 12 00 00" then values from column 23; following lines from column 4
};

/// Date and time of a record's first line in whole seconds on the system's own scale, treated as GPST. Throws
/// DamagedRecord.
[[nodiscard]] geodesy::GpsTime parse_epoch(std::string_view first_line, RecordLayout layout);

/// The values of a record by their index in the RINEX tables: three of the first line, four of each further
/// line. A field is parsed on access, so that invalid text in spare columns has no effect.
class RecordFields {
 public:
  /// @param lines must outlive this object
  RecordFields(const std::vector<std::string_view>& lines, RecordLayout layout)
      : lines_(lines), layout_(layout) {}

  /// Empty if blank or beyond the lines. Throws DamagedRecord for anything that is not a number.
  [[nodiscard]] std::optional<double> at(std::size_t i) const;

 private:
  const std::vector<std::string_view>& lines_;
  RecordLayout layout_;
};

/// Throws DamagedRecord if the indentation of a record's lines after the first is not blank: a lost character
/// has shifted them, and may have removed a sign.
void require_indentation(const std::vector<std::string_view>& lines, RecordLayout layout);

/// First and last number of a system's satellites allowed in RINEX files; a record outside is damaged.
[[nodiscard]] std::pair<int, int> satellite_numbers(gnss::System system);

/// Lines of a complete record.
[[nodiscard]] std::size_t line_count(gnss::System system);

/// The message type of RINEX 4; RINEX 2 and 3 have none.
enum class MessageName { kUnnamed, kInav, kFnav };

/// @param lines the record, first line included; @param epoch from parse_epoch()
/// Throws DamagedRecord with the problem: a missing field or a value outside the range of the ICD's field.
[[nodiscard]] gnss::KeplerEphemeris decode_kepler(gnss::SatelliteId id,
                                                  const std::vector<std::string_view>& lines,
                                                  RecordLayout layout, MessageName message);
/// The group delays in a record of `type` CNAV or CNV2 of GPS and QZSS, CNV1 or CNV2 of BeiDou (RINEX 4.00,
/// tables A9, A10, A18 and A19).
[[nodiscard]] gnss::SignalDelays decode_signal_delays(gnss::SatelliteId id,
                                                      const std::vector<std::string_view>& lines,
                                                      std::string_view type);
[[nodiscard]] gnss::GlonassEphemeris decode_glonass(gnss::SatelliteId id,
                                                    const std::vector<std::string_view>& lines,
                                                    RecordLayout layout);
[[nodiscard]] gnss::SbasEphemeris decode_sbas(gnss::SatelliteId id,
                                              const std::vector<std::string_view>& lines,
                                              RecordLayout layout);

}  // namespace canyon::rinex
