#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "canyon/run/motion/recorded_path.hpp"

namespace canyon::simulation {

/// Files of columns: CSV, solutions of RTKLIB, truth of the UrbanNav data sets.
/// "csv". The first line that is neither blank nor a comment (#, %) names the columns, or the last comment
/// above the numbers; another such line below holds from there. Semicolons, tabs, commas or else blanks
/// separate, whichever stands in it. Names are those of a quantity, with a unit behind or without:
/// latitude, latitude_deg, latitude [rad] (docs/scenario.md has all). @param columns a quantity -> the name
/// that a column has in the file, with a unit in brackets where it names none ("lat [rad]"), or its number
/// from 1 in a file without a header ("2 [rad]")
[[nodiscard]] RecordedPath read_csv(TextFile& file, geodesy::GpsTime start, const HeightReading& heights,
                                    const TrajectoryColumns& columns);

/// "rtklib": a solution file (.pos) of places, with blanks or commas between; times are dates or weeks of
/// GPST, UTC or JST, places latitude and longitude (also in degrees, minutes and seconds) and height, or
/// ECEF. Source: RTKLIB manual 2.4.2, appendix B.1.
[[nodiscard]] RecordedPath read_rtklib(TextFile& file, const HeightReading& heights);
/// Whether the first comments are those of such a file.
[[nodiscard]] bool is_rtklib(const std::filesystem::path& path);

/// "urbannav": GPS week, time of week, latitude, longitude, height with commas between; or, of 2021, UNIX
/// time, week, time of week, latitude and longitude in degrees, minutes and seconds, and height with blanks.
[[nodiscard]] RecordedPath read_urbannav(TextFile& file);
/// Whether the first line that is no comment is one of such a file.
[[nodiscard]] bool is_urbannav(const std::filesystem::path& path);

/// A quantity that read_csv() knows a column of.
struct CsvQuantity {
  std::string_view name, help;
};
[[nodiscard]] std::vector<CsvQuantity> csv_quantities();

}  // namespace canyon::simulation
