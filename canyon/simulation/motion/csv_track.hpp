#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "canyon/simulation/motion/recorded_path.hpp"

namespace canyon::simulation {

/// Files of columns: CSV, solutions of RTKLIB, truth of the UrbanNav data sets.
/// "csv". The first line that is neither blank nor a comment (#, %) names the columns, or the last comment
/// above the numbers; another such line further down applies from there on. The separator is the first of
/// semicolon, tab, comma and blank that the line has. A column has the name of a quantity, with or without a
/// unit: latitude, latitude_deg, latitude [rad] (docs/scenario.md has all). @param columns maps a quantity to
/// its column's name in the file, with a unit in brackets if the name has none ("lat [rad]"), or to its
/// number from 1 in a file without a header ("2 [rad]")
[[nodiscard]] RecordedPath read_csv(TextFile& file, geodesy::GpsTime start, const HeightReading& heights,
                                    const TrajectoryColumns& columns);

/// "rtklib": a solution file (.pos) of positions, separated by blanks or commas. Times are dates or weeks of
/// GPST, UTC or JST; positions are latitude and longitude (also in degrees, minutes and seconds) and height,
/// or ECEF. Source: RTKLIB manual 2.4.2, appendix B.1.
[[nodiscard]] RecordedPath read_rtklib(TextFile& file, const HeightReading& heights);
/// True if the first comments are those of a solution file of RTKLIB.
[[nodiscard]] bool is_rtklib(const std::filesystem::path& path);

/// "urbannav": GPS week, time of week, latitude, longitude, height, with commas between; or, of 2021, UNIX
/// time, week, time of week, latitude and longitude in degrees, minutes and seconds, and height with blanks.
[[nodiscard]] RecordedPath read_urbannav(TextFile& file);
/// True if the first line that is no comment has this form.
[[nodiscard]] bool is_urbannav(const std::filesystem::path& path);

/// A quantity for which read_csv() reads a column.
struct CsvQuantity {
  std::string_view name, help;
};
[[nodiscard]] std::vector<CsvQuantity> csv_quantities();

}  // namespace canyon::simulation
