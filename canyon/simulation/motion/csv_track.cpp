// Declared in canyon/simulation/motion/column_points.hpp.
// The reader of CSV files of positions.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "canyon/base/text.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/simulation/motion/column_points.hpp"
#include "canyon/simulation/motion/csv_columns.hpp"
#include "canyon/simulation/motion/csv_times.hpp"

namespace canyon::simulation {
namespace {

using geodesy::GpsTime;
using Fields = std::vector<std::string_view>;

/// Whether a field of the column CsvColumns::fix says that there is no fix. An empty one says nothing.
bool says_no_fix(std::string_view text, double least) {
  const std::string word = lower_case(trim(text));
  if (const auto number = parse_double(word)) return *number < least;
  for (const std::string_view begin : {"no ", "no_", "no-", "not "})
    if (word.starts_with(begin)) return true;
  for (const std::string_view none :
       {"none", "no", "nofix", "invalid", "false", "void", "v", "n", "nan", "network"})
    if (word == none) return true;
  return false;
}

class CsvReader {
 public:
  CsvReader(TextFile& file, GpsTime start, const HeightReading& heights)
      : file_(file),
        heights_(heights),
        notes_(file.path()),
        times_(file, columns_, start, notes_),
        points_(file, heights, notes_) {}

  TrajectoryFile read() {
    while (const auto line = file_.next_line()) {
      if (trim(*line).empty() || line == header_) continue;
      if (is_skipped(*line) || trim(*line).front() == '%' || trim(*line).starts_with("//")) {
        read_comment(*line);
        continue;
      }
      if (first_data_ && (!header_ || commented_)) {
        const bool blanks =
            commented_ && columns_.separator == ' ' && line->find(',') == std::string_view::npos;
        columns_.separator = blanks ? ' ' : separator_of(*line);
      }
      const Fields fields = fields_of(*line, columns_);
      if (is_csv_header(fields) ? first_ || names_positions(fields) : first_ && names_positions(fields)) {
        read_header(*line, fields);
        continue;
      }
      if (first_data_ && header_ && read_units(fields)) continue;
      // A title, and what a program writes below it.
      if (no_header_ && fields.size() < 4) continue;
      first_ = false;
      if (no_header_) throw InputError(*no_header_);
      if (first_data_ && !header_) require_own_header(fields);
      if (std::exchange(first_data_, false)) look_at(fields);
      notes_.guard([&] { read_record(fields); });
    }
    if (no_header_) throw InputError(*no_header_);
    note_heights();
    times_.note_late_start();
    times_.check_steps();
    if (whole_degrees_ && points_.size() >= 8)
      notes_.say(0, "all latitudes and longitudes are whole degrees", "were they rounded? export all digits");
    if (maybe_radians_) {
      notes_.say(0, "all latitudes and longitudes are below pi",
                 "if they are radians, name the columns latitude_rad and longitude_rad");
    }
    return points_.take(!times_.relative(), "'time, latitude, longitude, height'");
  }

 private:
  /// A header, above the data or where files were joined; or a title above it.
  void read_header(std::string_view line, const Fields& fields) {
    no_header_.reset();
    try {
      columns_ = CsvColumns(file_, fields, columns_.separator);
      header_ = line;
      first_ = false;
    } catch (const InputError& e) {
      no_header_ = e;
    }
  }

  /// Whether fields are the units of the header's columns.
  bool read_units(const Fields& fields) {
    const std::vector<std::string> names = with_units(fields_of(*header_, columns_), fields);
    if (!names.empty()) columns_ = CsvColumns(file_, {names.begin(), names.end()}, columns_.separator);
    return !names.empty();
  }

  /// Columns that a comment names otherwise are not time, latitude, longitude and height.
  void require_own_header(const Fields& fields) const {
    if (!names_others(fields_of(other_names_, columns_), fields.size())) return;
    throw file_.error(
        fmt::format("the comment above names columns without a latitude: '{}'", other_names_),
        "a path has latitudes and longitudes, or ECEF x, y, z; baselines and local metres have no "
        "place on the Earth");
  }

  /// A comment above the data may be the header.
  void read_comment(std::string_view line) {
    if (!first_) return;
    // RTKLIB: "% (lat/lon/height=WGS84/geodetic,Q=1:fix,...)".
    if (line.find("height=") != std::string_view::npos && line.find("/geodetic") != std::string_view::npos)
      above_geoid_ = true;
    line.remove_prefix(std::min(line.find_first_not_of("#%/ \t"), line.size()));
    CsvColumns comment;
    comment.separator = separator_of(line);
    const Fields fields = fields_of(line, comment);
    if (!names_positions(fields)) {
      other_names_ = trim(line);
      return;
    }
    columns_ = CsvColumns(file_, fields, comment.separator);
    columns_.place[2].sea_level = columns_.place[2].sea_level || above_geoid_;
    header_ = line;
    first_ = false;
    commented_ = true;
  }

  /// The first line of data.
  void look_at(const Fields& fields) {
    if (header_) {
      // A separator may end each line.
      if (fields.size() == columns_.count + 1 && fields.back().empty()) ++columns_.count;
      return;
    }
    columns_.count = std::max<std::size_t>(fields.size(), 4);
    if (fields.size() < 4) return;
    const auto x = field_number(fields[1]), y = field_number(fields[2]), z = field_number(fields[3]);
    columns_.ecef = x && y && z && looks_like_ecef(*x, *y, *z);
    if (columns_.ecef) notes_.say(0, "columns 2 to 4 are taken as ECEF x, y, z in metres");
    const auto whole = [](std::string_view field) { return parse_integer(field).has_value(); };
    if (columns_.separator == ',' && fields.size() > 6 &&
        std::all_of(fields.begin() + 1, fields.begin() + 7, whole)) {
      throw file_.error("whole numbers in all columns look like numbers with decimal commas",
                        "write points, put semicolons between the columns, or name the columns");
    }
  }

  void read_record(const Fields& fields) {
    if (fields.size() != columns_.count) {
      if (fields.size() == 1 && columns_.separator == ',' && split_blanks(fields[0]).size() >= 4)
        throw file_.error("blanks stand between the columns, and no header names them",
                          "put a line such as `time latitude longitude height` above, or commas between");
      throw file_.error(
          fmt::format("{} columns where {} are needed", fields.size(), columns_.count),
          "columns are time, latitude, longitude, height, as many in each line as in the first, with commas, "
          "semicolons or tabs between; decimal commas need semicolons or tabs");
    }
    if (columns_.fix && says_no_fix(fields[*columns_.fix], columns_.least_fix)) {
      points_.skip_no_fix();
      return;
    }
    // 4,294,967,295 mm, the largest number of 32 bits, and the like: a receiver without a fix.
    constexpr double kNoAccuracy = 1e6;
    if (columns_.accuracy && field_number(fields[*columns_.accuracy]).value_or(0) >= kNoAccuracy) {
      points_.skip_no_fix();
      return;
    }
    if (columns_.satellites && parse_double(fields[*columns_.satellites]) == 0)
      notes_.skip(file_.line(), "line with 0 satellites, by the file's own column", "it is taken");
    if (is_missing(fields[columns_.time.index])) {
      points_.skip_missing();
      return;
    }
    find_mark(fields);
    const std::string_view height = fields[columns_.place[2].index];
    if (ungrouped(height) != height)
      notes_.skip(file_.line(), "height with separators of thousands", "1,500 is taken as 1500");
    std::array<std::string, 3> text;
    for (std::size_t k = 0; k < 3; ++k) text[k] = converted(k, fields);
    constexpr double kHigh_m = 50e3;
    const auto latitude = field_number(text[0]), longitude = field_number(text[1]);
    maybe_radians_ = maybe_radians_ && !columns_.ecef && !columns_.place[0].unit && latitude && longitude &&
                     std::abs(*latitude) < geodesy::kPi / 2 && std::abs(*longitude) < geodesy::kPi &&
                     std::abs(field_number(text[2]).value_or(0)) < kHigh_m;
    const auto fraction = [](const std::optional<double>& x) { return x && *x != std::round(*x); };
    whole_degrees_ = whole_degrees_ && !columns_.ecef && !fraction(latitude) && !fraction(longitude);
    points_.add(times_.read(fields), {text[0], text[1], text[2]}, columns_.ecef);
  }

  /// The decimal mark, by latitudes and longitudes: the other one groups thousands.
  void find_mark(const Fields& fields) {
    for (std::size_t k = 0; k < 2 && mark_ == 0; ++k) {
      const std::size_t at = fields[columns_.place[k].index].find_first_of(".,");
      if (at != std::string_view::npos) mark_ = fields[columns_.place[k].index][at];
    }
  }

  /// A height, or a coordinate in metres, without the separators of its thousands.
  [[nodiscard]] std::string ungrouped(std::string_view text) const {
    return mark_ == 0 ? std::string(text) : without_groups(text, mark_);
  }

  /// A coordinate in degrees or metres. What needs no conversion stays, with its faults.
  [[nodiscard]] std::string converted(std::size_t k, const Fields& fields) const {
    const CsvColumn& column = columns_.place[k];
    const std::string_view text = fields[column.index];
    if (is_missing(text)) return std::string(text);
    const std::optional<double> plain = field_number(text);
    if (k == 2 || columns_.ecef) {
      const std::string number = ungrouped(text);
      double value = to_number(file_, number, columns_.ecef ? "coordinate" : "height") * column.scale;
      if (adds_geoid() && k == 2) {
        if (is_missing(fields[*columns_.geoid])) return {};
        value += to_number(file_, fields[*columns_.geoid], "geoid height");
      } else if (k == 2 && column.sea_level) {
        value += heights_.geoid_undulation_m;
      } else if (column.scale == 1) {
        return number;
      }
      return fmt::format("{:.6f}", value);
    }
    auto side_index = k == 0 ? columns_.latitude_side : columns_.longitude_side;
    if (side_index && side_index == columns_.satellites && parse_double(fields[*side_index]))
      side_index.reset();
    if (plain && column.scale == 1 && !column.minutes && !side_index && column.side.empty())
      return std::string(text);
    const std::string_view side = side_index ? fields[*side_index] : column.side;
    if (side_index && trim(side).empty()) return {};
    const auto angle = angle_deg(text, side, k == 0, column.minutes);
    if (!angle) {
      throw file_.error(
          fmt::format("the {} '{}' {}is not an angle", k == 0 ? "latitude" : "longitude", trim(text),
                      side_index ? fmt::format("with the side '{}' ", trim(side)) : std::string()),
          "write 48.1, -48.1, 48.1S or 48 06 00 S");
    }
    const double value_deg = *angle * column.scale;
    if (column.unit && std::abs(value_deg) > 360) {
      throw file_.error(fmt::format("{} in column '{}' is {:.1f} deg", trim(text), column.name, value_deg),
                        "name the column by the unit that it has");
    }
    return fmt::format("{:.12f}", value_deg);
  }
  [[nodiscard]] bool adds_geoid() const {
    const CsvColumn& height = columns_.place[2];
    const std::string name = lower_case(height.name);
    return columns_.geoid && !columns_.ecef && !height.ellipsoid &&
           (height.sea_level || name.find("alt") != std::string::npos ||
            name.find("ele") != std::string::npos);
  }
  void note_heights() {
    const CsvColumn& height = columns_.place[2];
    if (adds_geoid() && !height.sea_level && heights_.needed && points_.size() > 0) {
      notes_.say(0, fmt::format("heights are '{}' plus the column of the geoid", height.name),
                 "name it height_ellipsoid if it already is above the ellipsoid");
    }
    if (!columns_.place[2].sea_level || adds_geoid() || !heights_.needed) return;
    notes_.say(0,
               heights_.geoid_undulation_m != 0
                   ? fmt::format("heights are above sea level by the header: the city's geoid undulation, "
                                 "{:.1f} m, is added",
                                 heights_.geoid_undulation_m)
                   : std::string("heights are above sea level by the header and are taken as ellipsoidal; "
                                 "city.geoid_undulation_m corrects them, height_above_terrain_m does without "
                                 "them"));
  }

  TextFile& file_;
  HeightReading heights_;
  RecordNotes notes_;
  CsvColumns columns_;
  CsvTimes times_;
  ColumnPoints points_;
  std::optional<std::string> header_;
  std::string other_names_;              ///< the last comment above the data that names no positions
  std::optional<InputError> no_header_;  ///< why the lines above are no header
  bool first_ = true, first_data_ = true, maybe_radians_ = true, whole_degrees_ = true;
  char mark_ = 0;             ///< the decimal mark; 0: not known yet
  bool above_geoid_ = false;  ///< heights are, by a comment above the header
  bool commented_ = false;    ///< the header is a comment: its separator may be another than that of the data
};

}  // namespace

TrajectoryFile read_csv_track(TextFile& file, GpsTime start, const HeightReading& heights) {
  return CsvReader(file, start, heights).read();
}

}  // namespace canyon::simulation
