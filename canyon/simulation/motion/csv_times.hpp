#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/record_notes.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/simulation/motion/csv_columns.hpp"

namespace canyon::simulation {

/// "2024-05-01" of that, of 2024/05/01 and of 20240501; empty for other texts: 01.05.24 may be of three
/// kinds.
[[nodiscard]] std::string iso_date(std::string_view text);

/// The times of a file of columns: ISO 8601, GPS week and seconds of it, Unix times, or seconds from `start`;
/// all of one kind. Numbers that only Unix times of 2000 to 2100 can be are taken as such, in seconds, ms, us
/// or ns by their size, with a remark.
class CsvTimes {
 public:
  /// `columns` may change until the first call of read().
  CsvTimes(const TextFile& file, const CsvColumns& columns, geodesy::GpsTime start, RecordNotes& notes)
      : file_(file), columns_(columns), start_(start), notes_(notes) {}

  /// Throws InputError for a time that cannot be read, or is of another kind than those above.
  geodesy::GpsTime read(const std::vector<std::string_view>& fields);
  /// Whether times are seconds from the start.
  [[nodiscard]] bool relative() const { return kind_ == Kind::FromStart; }
  /// Says where seconds from the start begin so late that they may count from something else.
  void note_late_start() const;
  /// Throws InputError where seconds from the start, by a column without a unit, are 10,000 s and more apart.
  void check_steps() const;

 private:
  enum class Kind : std::uint8_t { Unknown, FromStart, Dates, Weeks, Unix };

  std::pair<Kind, geodesy::GpsTime> kind_and_time(const std::vector<std::string_view>& fields,
                                                  std::string_view text);
  /// The kind, where times above are of no other.
  [[nodiscard]] Kind require_kind(Kind kind, std::string_view text) const;
  [[nodiscard]] std::string on_date(std::string_view date_text, std::string_view time_text) const;
  [[nodiscard]] std::optional<geodesy::GpsTime> of_week(const std::vector<std::string_view>& fields) const;
  [[nodiscard]] geodesy::GpsTime from_unix(double seconds, std::string_view text) const;
  /// Seconds of one unit of a Unix time by its size; nothing for other numbers.
  [[nodiscard]] std::optional<double> unix_unit_s(double value) const;
  void note_unix(double unit_s, std::string_view text) const;
  [[nodiscard]] geodesy::GpsTime from_start(double seconds, std::string_view text);
  [[nodiscard]] geodesy::GpsTime dated(std::string text);

  const TextFile& file_;
  const CsvColumns& columns_;
  geodesy::GpsTime start_;
  RecordNotes& notes_;
  Kind kind_ = Kind::Unknown;
  std::optional<double> unix_unit_s_, first_s_;
  double last_s_ = 0;
  std::size_t count_ = 0;  ///< of times from the start
  bool warned_ = false;
};

}  // namespace canyon::simulation
