#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/text_file.hpp"

/// Columns of a CSV file of positions, by its header.
namespace canyon::simulation {

/// A column that is read.
struct CsvColumn {
  std::size_t index = 0;
  std::string name;            ///< as in the header; empty without one
  double scale = 1;            ///< to degrees, metres or seconds
  bool unit = false;           ///< whether the header names a unit
  bool minutes = false;        ///< angles as degrees and minutes in one number, ddmm.mmmm
  bool parted = false;         ///< angles as degrees, minutes and seconds with blanks between
  bool sea_level = false;      ///< a height above sea level, by its name
  bool ellipsoid = false;      ///< a height above the ellipsoid, by its name
  bool truth = false;          ///< a true place beside one that was estimated, by its name
  std::string_view side = {};  ///< "S" or "W" where the name says so: "lon (W)"
};

/// The separator between the columns of a line: semicolons or tabs where there are three of them (commas may
/// then be decimal points), else commas, else blanks between names of columns or behind a date.
[[nodiscard]] char separator_of(std::string_view line);

/// The clock of the times, by the header.
enum class CsvClock : std::uint8_t { Unsaid, Utc, Gps, Unix, Jst, GpsEpoch };

struct CsvColumns {
  char separator = ',';
  CsvColumn time, place[3];         ///< latitude, longitude, height, or x, y, z
  std::optional<std::size_t> week;  ///< of GPS; `time` is then the time of week
  bool time_of_week = false;        ///< `time` is the time of week by its name
  bool ecef = false;
  bool fit = false;  ///< semicircles: Garmin's FIT, whose times may be seconds since 1989-12-31
  CsvClock clock = CsvClock::Unsaid;
  std::optional<std::size_t> date, latitude_side, longitude_side, geoid;
  std::optional<std::size_t> fix;         ///< a column that says whether there is a fix
  double least_fix = 1;                   ///< a smaller number in it says that there is none
  std::optional<std::size_t> accuracy;    ///< horizontal, in any unit from mm to m
  std::optional<std::size_t> satellites;  ///< how many are used; "ns" may be this or the latitude's side
  std::size_t count = 0;                  ///< of columns; 0: not known yet

  /// Columns in the order time, latitude, longitude, height.
  CsvColumns();
  /// Throws InputError where a column is missing or in a unit that is none of its kind.
  CsvColumns(const TextFile& file, const std::vector<std::string_view>& header, char separator);
};

/// The fields of a line of these columns. Where blanks are between, a date and the time behind it, or a GPS
/// week and the time of week, are one field for a header with one name for both.
[[nodiscard]] std::vector<std::string_view> fields_of(std::string_view line, const CsvColumns& columns);

/// Whether fields name a latitude or x among columns.
[[nodiscard]] bool names_positions(const std::vector<std::string_view>& fields);
/// Whether fields name columns, and no latitude or x among them, as many as those of a line of data. A date
/// and a time may be two there.
[[nodiscard]] bool names_others(const std::vector<std::string_view>& fields, std::size_t data);

/// The names of a header with the units of the line below it, "[s]" or "s"; empty where that line is another.
[[nodiscard]] std::vector<std::string> with_units(const std::vector<std::string_view>& header,
                                                  const std::vector<std::string_view>& below);

/// Degrees of "48.1", "48.1N", "S 33 51.5", "48 07'02.3\"N"; with `minutes` also of 4807.038. `side` is a
/// field with N, S, E or W, or empty. Empty for other texts, and where sign and side contradict.
[[nodiscard]] std::optional<double> angle_deg(std::string_view text, std::string_view side, bool latitude,
                                              bool minutes);

}  // namespace canyon::simulation
