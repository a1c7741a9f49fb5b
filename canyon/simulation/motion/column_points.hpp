#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

/// Functions that readers of text columns share.
namespace canyon::simulation {

/// A field as a number; a comma counts as the decimal point where it does not separate columns.
[[nodiscard]] std::optional<double> field_number(std::string_view text);
/// The same, or an InputError that names `what`.
[[nodiscard]] double to_number(const TextFile& file, std::string_view text, std::string_view what);

/// A number whose decimal mark is `mark`, '.' or ',', without separators of thousands: 1500.5 of 1,500.5. A
/// text that is not grouped so stays.
[[nodiscard]] std::string without_groups(std::string_view text, char mark);

/// An instant by the GPS week, counted since 1980, and the seconds in it; an InputError where there is none,
/// and for weeks before 1999, which are counted modulo 1,024.
[[nodiscard]] geodesy::GpsTime time_of_week(const TextFile& file, std::string_view week, double tow_s);

/// Whether three numbers are a place near the ground in ECEF [m].
[[nodiscard]] bool looks_like_ecef(double x, double y, double z);

/// Blank lines and comments.
[[nodiscard]] bool is_skipped(std::string_view line);

/// Fields of a line by RFC 4180, without blanks and quotes around them.
[[nodiscard]] std::vector<std::string_view> csv_fields(std::string_view line, char separator);
/// Whether fields are names of columns: some begin with a letter, none with a digit.
[[nodiscard]] bool is_csv_header(const std::vector<std::string_view>& fields);

/// The points of a file of columns. A record without a position, or with one that cannot be, is left out and
/// counted.
class ColumnPoints {
 public:
  using Coordinates = std::array<std::string_view, 3>;

  ColumnPoints(const TextFile& file, const HeightReading& heights, RecordNotes& notes)
      : file_(file), heights_(heights), notes_(notes) {}

  /// `ecef`: the coordinates are x, y, z [m]; else latitude and longitude [deg] and height [m].
  void add(geodesy::GpsTime time, Coordinates text, bool ecef);
  [[nodiscard]] std::size_t size() const { return points_.size(); }
  void skip_missing() { notes_.skip(file_.line(), kMissing); }
  void skip_no_fix() { notes_.skip(file_.line(), kNoFix); }

  /// Throws where there are none, or where no more than half of the records are good. `expected` describes a
  /// line.
  [[nodiscard]] TrajectoryFile take(bool has_own_dates, std::string_view expected);

 private:
  static constexpr std::string_view kMissing = "line without a time or a position";
  static constexpr std::string_view kNoFix = "line without a fix, by the file's own column";

  const TextFile& file_;
  HeightReading heights_;
  RecordNotes& notes_;
  RecordedPoints points_;
  std::string last_height_;
  std::optional<InputError> first_missing_;
};

/// "csv" of read_trajectory().
[[nodiscard]] TrajectoryFile read_csv_track(TextFile& file, geodesy::GpsTime start,
                                            const HeightReading& heights);

}  // namespace canyon::simulation
