#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/simulation/motion/nmea_sentences.hpp"

/// Sentences of NMEA 0183 that have a position.
namespace canyon::simulation {

/// A sentence that has a position, and where its fields are; 0: it has no such field.
struct NmeaPositionKind {
  std::string_view name;
  std::size_t fields, time, latitude, status, mode, satellites, dilution, altitude, separation;
};
/// NMEA 0183, in the order of what they say: the first kind that has a fix in a log is read; GNS, where it
/// has more than GGA.
inline constexpr std::array<NmeaPositionKind, 4> kNmeaPositionKinds{{{"GGA", 12, 1, 2, 0, 0, 7, 8, 9, 11},
                                                                     {"GNS", 11, 1, 2, 0, 6, 7, 8, 9, 10},
                                                                     {"RMC", 10, 1, 3, 2, 12, 0, 0, 0, 0},
                                                                     {"GLL", 7, 5, 1, 6, 7, 0, 0, 0, 0}}};

/// The sentence of a position.
struct NmeaPosition {
  bool fix = false;
  bool altitude = false;
  bool separation = false;
  bool zero_altitude = false, zero_separation = false;
  bool checked = false;
  bool no_satellites = false;    ///< says that none is used
  bool short_longitude = false;  ///< of no more digits than degrees have
  bool diluted = false;          ///< has a dilution of precision that stands for none, such as 99.99
  long long quality = 0;
  long long dimensions = 0;  ///< the best mode of the GSA sentences behind it: 1 no fix, 2 or 3 dimensions
  int line = 0;
  std::int64_t time_of_day_ns = 0;
  geodesy::Geodetic place;  ///< its height is altitude plus separation; a missing one counts as 0
};

/// Whether RMC's or GLL's status says that there is no fix.
[[nodiscard]] bool is_void(std::string_view status, std::string_view mode);

/// hhmmss.sss as nanoseconds of the UTC day (a leap second's 235960 comes out as 24 h). Throws InputError.
[[nodiscard]] std::int64_t nmea_time_of_day(const TextFile& file, std::string_view text);

/// Without a fix only `checked`, `quality` and `line` are set. Throws InputError for values that are none.
/// Precondition: at least NmeaPositionKind::fields fields.
[[nodiscard]] NmeaPosition read_position(const TextFile& file, const NmeaPositionKind& kind,
                                         const NmeaSentence& sentence);

}  // namespace canyon::simulation
