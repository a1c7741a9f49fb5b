#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "canyon/sky/rinex/fields.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"

namespace canyon::rinex {

// Fields and epoch lines of observation files, for RinexObservationReader.
/// Nothing but spaces, or nothing.
[[nodiscard]] bool is_blank(std::string_view text);

enum class ObservationField : std::uint8_t { Blank, Number, Bad };
/// A number between spaces. Digits with one point, the notation of RINEX, are exact to the last bit up to 15
/// digits, because they are the quotient of two exact integers; other texts are parsed by parse_double().
/// `value` is set for Number only.
[[nodiscard]] ObservationField parse_field(std::string_view text, double& value);

/// Kinds of observations: pseudorange, phase, Doppler, C/N0.
inline constexpr std::string_view kObservationKinds = "CLDS";

/// Ranges of measurements on and near the Earth; fill values and other units are outside. Clocks may be off
/// by up to a quarter of a second.
struct Plausible {
  const char *what, *unit;
  double least, maximum;
};
inline constexpr std::array<Plausible, 4> kPlausibleValues{{{"pseudorange", "m", 1e7, 1e8},
                                                            {"carrier phase", "cycles", -1e11, 1e11},
                                                            {"Doppler", "Hz", -1e5, 1e5},
                                                            {"C/N0", "dB-Hz", 0, 80}}};

struct EpochLine {
  int flag = 0;           ///< 0 to 6
  std::size_t count = 0;  ///< of satellites, or records of an event
  /// Empty only for events (flags 2 to 5) without a time.
  std::optional<geodesy::GpsTime> time;
  std::optional<double> clock_offset_s;
};
/// An epoch line of version 2, and of versions 3 and 4, in a file of that time system; empty for any other
/// line and for damaged ones. The satellites that follow in version 2 are ignored.
[[nodiscard]] std::optional<EpochLine> epoch_line2(std::string_view line, std::string_view time_system);
[[nodiscard]] std::optional<EpochLine> epoch_line3(std::string_view line, std::string_view time_system);

// Meanings of the codes of observation files, for RinexObservationReader: RINEX 3.05, tables 4 to 10; 2.11,
// table A1, and 2.12.

/// The columns of a code's values in versions 2.x.
struct Version2Types {
  std::string_view systems;  ///< letters
  std::string_view code;     ///< in the notation of versions 3 and 4
  std::string_view range;    ///< type of the pseudorange
  char band;                 ///< of phase, Doppler and strength: L1, D1, S1
  double from, before;       ///< versions
};
[[nodiscard]] std::span<const Version2Types> version2_types();

/// Whether any signal of a system is read from a code in files of versions 3 and 4.
[[nodiscard]] bool is_known_code(gnss::System system, std::string_view code, double version);

/// Header records of an observation file, applied one by one; continuation lines follow the line that they
/// continue. RinexObservationReader uses it for the header and for the records in events.
class HeaderRecords {
 public:
  /// Reads the first line. Empty if it is valid, else the problem and the hint.
  struct Fault {
    std::string problem, hint;
  };
  [[nodiscard]] std::optional<Fault> begin(std::string_view line);

  enum class Outcome { Applied, Unknown, Damaged, Fatal, End };
  struct Result {
    Outcome outcome = Outcome::Applied;
    std::string reason;  ///< for Damaged (the record is skipped) and Fatal (no observation could be read)
  };
  [[nodiscard]] Result apply(std::string_view line);
  void set_moving(bool moving) { header_.moving = moving; }
  void forget_position() { header_.approximate_position_ecef.reset(); }

  [[nodiscard]] const ObservationHeader& header() const { return header_; }
  [[nodiscard]] int major() const { return static_cast<int>(header_.version); }
  /// Values of this type are multiplied by this factor in the file.
  [[nodiscard]] double factor(char system, const std::string& type) const;

 private:
  Result types2(std::string_view line);
  Result types3(std::string_view line);
  Result scale_factor(std::string_view line);
  Result glonass_slots(std::string_view line);
  Result glonass_biases(std::string_view line);
  Result time(std::string_view line, bool first);

  ObservationHeader header_;
  char types_system_ = 0;         ///< system of the types being continued
  std::size_t types_wanted_ = 0;  ///< in all
  std::map<char, std::map<std::string, double>> factors_;
  char factor_system_ = 0;
  double factor_ = 1;
  std::size_t factor_wanted_ = 0;  ///< types still to come
};

}  // namespace canyon::rinex
