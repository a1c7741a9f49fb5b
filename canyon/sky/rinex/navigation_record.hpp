#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::rinex {

/// The part of the RINEX navigation reader that turns the lines of one record into an ephemeris.

/// Why a record is not taken: thrown by the decoders, caught by the reader, which adds file and line.
struct DamagedRecord {
  std::string reason;
};

/// Column layout of a record.
enum class RecordLayout {
  kVersion2,  ///< " 1 12 10 31  0  0  0.0" then values from column 22; following lines from column 3
  kVersion3,  ///< "G01 2019 04 27 12 00 00" then values from column 23; following lines from column 4
};

/// Seconds-exact date and time of a record's first line on the system's own scale, as if it were GPST.
/// Throws DamagedRecord.
[[nodiscard]] geodesy::GpsTime parse_epoch(std::string_view first_line, RecordLayout layout);

/// The values of a record by their place in the RINEX tables: three of the first line, four of each further
/// line. A field is looked at when asked for, so that rubbish in spare columns does no harm.
class RecordFields {
 public:
  /// @param lines outlive the object
  RecordFields(const std::vector<std::string_view>& lines, RecordLayout layout)
      : lines_(lines), layout_(layout) {}

  /// Empty where blank or beyond the lines. Throws DamagedRecord for anything that is not a number.
  [[nodiscard]] std::optional<double> at(std::size_t i) const;

 private:
  const std::vector<std::string_view>& lines_;
  RecordLayout layout_;
};

/// Throws DamagedRecord where something stands in the indentation of a record's lines but the first: a lost
/// character has shifted them, and may have taken a sign.
void require_indentation(const std::vector<std::string_view>& lines, RecordLayout layout);

/// First and last number of a system's satellites that RINEX files may name; a record beyond is damaged.
[[nodiscard]] std::pair<int, int> satellite_numbers(gnss::System system);

/// Lines of a complete record.
[[nodiscard]] std::size_t line_count(gnss::System system);

/// The message type that RINEX 4 names; RINEX 2 and 3 do not.
enum class MessageName { kUnnamed, kInav, kFnav };

/// @param lines the record, first line included; @param epoch of parse_epoch()
/// Throws DamagedRecord with what is wrong: a missing field or a value outside what the ICD's field can hold.
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
